"""PPO from nothing in one file, in the style of CleanRL: one network for all robots.

They read and command in the frame of their motion (`wrappers.MotionFrame`).
"""

from typing import Any

import torch
from torch import nn
from torch.distributions import Normal

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.motion import INPUTS
from swarm_logistics_env.wrappers import MotionFrame

REWARDS = {
    "own_delivery": 1.0, "lift_requested": 0.5, "approach": 0.1, "stocking": 0.1, "contact": -0.05
}  # fmt: skip
SMALL: dict[str, Any] = {"warehouse_width": 6.0, "warehouse_height": 5.0, "delivery_width": 1.5}
WORLDS, STEPS, EPOCHS, BATCH, DISCOUNT, TRACE, CLIP = 12, 128, 4, 480, 0.99, 0.95, 0.2


def network(n_outputs):
    hidden = [nn.Linear(len(INPUTS), 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()]
    return nn.Sequential(*hidden, nn.Linear(64, n_outputs))


def main(total_timesteps=1_000_000, duration=200.0, seed=0, judged=20):
    torch.set_num_threads(1)  # networks this small are slower on several
    torch.manual_seed(seed)
    scenario = Scenario(n_robots=10, n_items=8, restock=True, duration=duration, **SMALL)
    env = SwarmVecEnv(
        make_env=lambda _: MotionFrame(SwarmLogisticsEnv(scenario, rewards=REWARDS)),
        n_worlds=WORLDS,
        seed=seed,
    )
    actor, critic, spread = network(3), network(1), nn.Parameter(torch.full((3,), -0.6))
    # Untrained it drives ahead: a robot that trembles on the spot meets nothing to learn from.
    nn.init.orthogonal_(actor[-1].weight, 0.01)
    actor[-1].bias.data[0] = 0.8
    learned = [*actor.parameters(), *critic.parameters(), spread]
    optimizer = torch.optim.Adam(learned, lr=1e-3)
    seen = torch.from_numpy(env.reset())
    updates = total_timesteps // (STEPS * env.num_envs)
    for update in range(updates):
        taken = []
        with torch.no_grad():
            for _ in range(STEPS):
                policy = Normal(actor(seen), spread.exp())
                action = policy.sample()
                rows, reward, done, _ = env.step(action.clamp(-1.0, 1.0).numpy())
                chance, value = policy.log_prob(action).sum(1), critic(seen)[:, 0]
                reward, done = torch.from_numpy(reward), torch.from_numpy(done).float()
                taken.append((seen, action, chance, value, reward, done))
                seen = torch.from_numpy(rows)
            old, action, chance, value, reward, done = map(torch.stack, zip(*taken))
            gain, ahead, following = torch.zeros_like(value), 0.0, critic(seen)[:, 0]
            for t in reversed(range(STEPS)):  # generalised advantage estimation
                error = reward[t] + DISCOUNT * following * (1.0 - done[t]) - value[t]
                gain[t] = ahead = error + DISCOUNT * TRACE * (1.0 - done[t]) * ahead
                following = value[t]
        flat = [part.flatten(0, 1) for part in (old, action, chance, gain, gain + value)]
        for _ in range(EPOCHS):
            for some in torch.randperm(len(flat[0])).split(BATCH):
                old, action, chance, gain, target = (part[some] for part in flat)
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                ratio = (Normal(actor(old), spread.exp()).log_prob(action).sum(1) - chance).exp()
                paid = torch.min(ratio * gain, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * gain).mean()
                loss = 0.5 * (critic(old)[:, 0] - target).square().mean() - paid
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(learned, 0.5)
                optimizer.step()
        if update % 5 == 0 or update == updates - 1:
            mean = sum(paid[4].mean() for paid in taken) / STEPS
            print(f"update {update + 1} of {updates}: {mean:.4f} of reward a step", flush=True)
    return compared(actor, spread, scenario, range(1000, 1000 + judged))


@torch.no_grad()
def compared(actor, spread, scenario, seeds):
    """Return P of what was learned and of Swarm D-T on the same seeds, which nothing learned on."""
    env, own = MotionFrame(SwarmLogisticsEnv(scenario)), []
    for seed in seeds:
        seen = env.reset_arrays(seed)
        while env.agents:
            action = Normal(actor(torch.from_numpy(seen)), spread.exp()).sample()
            seen = env.step_arrays(action.clamp(-1.0, 1.0).numpy())[0]
        own.append(env.warehouse.state.delivered)
    scripted = [run_episode(scenario, policies.load("swarm-dt"), seed).delivered for seed in seeds]
    print(f"P on {len(seeds)} seeds: {own}; Swarm D-T's on the same: {scripted}")
    return own, scripted


if __name__ == "__main__":
    main()
