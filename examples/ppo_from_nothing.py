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
from swarm_logistics_env.world.motion import INPUTS
from swarm_logistics_env.wrappers import MotionFrame

REWARDS = {
    "own_delivery": 1.0, "lift_requested": 0.5, "approach": 0.1, "stocking": 0.1, "contact": -0.05
}  # fmt: skip
SMALL: dict[str, Any] = {"warehouse_width": 6.0, "warehouse_height": 5.0, "delivery_width": 1.5}
NUM_WORLDS = 12
NUM_STEPS = 128  # of a rollout
UPDATE_EPOCHS = 4
MINIBATCH_SIZE = 480
GAMMA = 0.99
GAE_LAMBDA = 0.95
CLIP_COEF = 0.2
VF_COEF = 0.5
MAX_GRAD_NORM = 0.5


def network(n_outputs):
    hidden = [nn.Linear(len(INPUTS), 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()]
    return nn.Sequential(*hidden, nn.Linear(64, n_outputs))


class Agent:
    def __init__(self):
        self.actor = network(3)
        self.critic = network(1)
        self.actor_logstd = nn.Parameter(torch.full((3,), -0.6))
        # Untrained it drives ahead: a robot that trembles on the spot meets nothing to learn from.
        nn.init.orthogonal_(self.actor[-1].weight, 0.01)
        self.actor[-1].bias.data[0] = 0.8

    def parameters(self):
        return [*self.actor.parameters(), *self.critic.parameters(), self.actor_logstd]

    def distribution(self, obs):
        return Normal(self.actor(obs), self.actor_logstd.exp())

    def value(self, obs):
        return self.critic(obs)[:, 0]


def main(total_timesteps=1_000_000, duration=200.0, seed=0, judged=20):
    torch.set_num_threads(1)  # networks this small are slower on several
    torch.manual_seed(seed)
    scenario = Scenario(n_robots=10, n_items=8, restock=True, duration=duration, **SMALL)
    envs = SwarmVecEnv(
        make_env=lambda _: MotionFrame(SwarmLogisticsEnv(scenario, rewards=REWARDS)),
        n_worlds=NUM_WORLDS,
        seed=seed,
    )
    agent = Agent()
    optimizer = torch.optim.Adam(agent.parameters(), lr=1e-3)
    next_obs = torch.from_numpy(envs.reset())
    num_updates = total_timesteps // (NUM_STEPS * envs.num_envs)
    for update in range(1, num_updates + 1):
        next_obs, rollout = collect(agent, envs, next_obs)
        obs, actions, logprobs, rewards, dones, values = rollout
        advantages = generalised_advantages(rewards, dones, values, agent.value(next_obs).detach())
        batch = (obs, actions, logprobs, advantages, advantages + values)
        optimise(agent, optimizer, [part.flatten(0, 1) for part in batch])
        if update % 5 == 1 or update == num_updates:
            mean_reward = rewards.mean(dim=1).mean()
            print(
                f"update {update} of {num_updates}: {mean_reward:.4f} of reward a step", flush=True
            )
    return evaluate(agent, scenario, range(1000, 1000 + judged))


@torch.no_grad()
def collect(agent, envs, next_obs):
    """Return the observations after a rollout, and its steps, each of shape (steps, robots, ..)."""
    steps = []
    for _ in range(NUM_STEPS):
        obs = next_obs
        distribution = agent.distribution(obs)
        action = distribution.sample()
        logprob = distribution.log_prob(action).sum(1)
        next_obs, reward, done, _ = envs.step(action.clamp(-1.0, 1.0).numpy())
        next_obs = torch.from_numpy(next_obs)
        reward = torch.from_numpy(reward)
        done = torch.from_numpy(done).float()
        steps.append((obs, action, logprob, reward, done, agent.value(obs)))
    return next_obs, [torch.stack(column) for column in zip(*steps)]


def generalised_advantages(rewards, dones, values, next_value):
    advantages = torch.zeros_like(values)
    last_gae = 0.0
    for t in reversed(range(NUM_STEPS)):
        nonterminal = 1.0 - dones[t]
        delta = rewards[t] + GAMMA * next_value * nonterminal - values[t]
        last_gae = delta + GAMMA * GAE_LAMBDA * nonterminal * last_gae
        advantages[t] = last_gae
        next_value = values[t]
    return advantages


def optimise(agent, optimizer, batch):
    for _ in range(UPDATE_EPOCHS):
        for minibatch in torch.randperm(len(batch[0])).split(MINIBATCH_SIZE):
            obs, actions, old_logprobs, advantages, returns = (part[minibatch] for part in batch)
            advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
            logprobs = agent.distribution(obs).log_prob(actions).sum(1)
            ratio = (logprobs - old_logprobs).exp()
            clipped_ratio = ratio.clamp(1.0 - CLIP_COEF, 1.0 + CLIP_COEF)
            policy_loss = -torch.min(ratio * advantages, clipped_ratio * advantages).mean()
            value_loss = (agent.value(obs) - returns).square().mean()
            loss = policy_loss + VF_COEF * value_loss
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), MAX_GRAD_NORM)
            optimizer.step()


@torch.no_grad()
def evaluate(agent, scenario, seeds):
    """Return P of the network and of Swarm D-T on the same seeds, on which nothing was learned."""
    env = MotionFrame(SwarmLogisticsEnv(scenario))
    learned = []
    for seed in seeds:
        obs = env.reset_arrays(seed)
        while env.agents:
            action = agent.distribution(torch.from_numpy(obs)).sample()
            obs, *_ = env.step_arrays(action.clamp(-1.0, 1.0).numpy())
        learned.append(env.warehouse.state.delivered)
    scripted = [run_episode(scenario, policies.load("swarm-dt"), seed).delivered for seed in seeds]
    print(f"P on {len(seeds)} seeds: {learned}; Swarm D-T's on the same: {scripted}")
    return learned, scripted


if __name__ == "__main__":
    main()
