"""Six learners of other people's code: what each takes, and P before and after.

`make interop-calls` plays it. Rows of `motion.INPUTS` and outputs (N, 3) are in the frame of each
robot's motion; the world is small, so that an untrained robot meets the requested item by chance.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import torch
from torch import nn

from swarm_logistics_env import Scenario, policies, record, run_episode, swarm_logistics_v0
from swarm_logistics_env.adapters import SwarmRows, SwarmVecEnv
from swarm_logistics_env.world.motion import INPUTS
from swarm_logistics_env.wrappers import DiscreteActions, MotionFrame

WORLD = Scenario(n_robots=6, warehouse_width=6.0, warehouse_height=5.0, delivery_width=1.5,
                 n_items=8, duration=100.0, restock=True)  # fmt: skip
REWARDS = {"delivery": 0.2, "own_delivery": 1.0, "lift_requested": 0.3, "approach": 0.3}
SEEDS = range(700_000, 700_005)
Row = tuple[str, str, float, float]  # learner, what it took, P before and after


def make_env(_: int = 0) -> MotionFrame:
    """Return a world to learn in."""
    return MotionFrame(swarm_logistics_v0.parallel_env(WORLD, rewards=REWARDS))


def performance(model: Any) -> float:
    """Return mean P of a network of the frame of motion."""
    policy = policies.of(model, frame=True)
    return float(np.mean([run_episode(WORLD, policy, seed).delivered for seed in SEEDS]))


def network(n_inputs: int, n_outputs: int) -> nn.Sequential:
    """Return an untrained network that drives ahead."""
    last = nn.Linear(64, n_outputs)
    with torch.no_grad():
        last.weight.mul_(0.01)
        last.bias.zero_()
        last.bias[0] = 0.8 if n_outputs > 1 else 0.0
    return nn.Sequential(nn.Linear(n_inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), last)


def cleanrl_loop(updates: int = 120, n_steps: int = 128) -> Row:
    """Learn by PPO in one file, as CleanRL writes it, on Gymnasium's vector environment."""
    torch.manual_seed(0)
    env = SwarmRows(12, make_env=make_env, autoreset_mode="same_step")
    n_rows, (n_inputs,), (n_outputs,) = env.num_envs, (len(INPUTS),), (3,)
    actor, critic = network(n_inputs, n_outputs), network(n_inputs, 1)
    deviations = nn.Parameter(torch.full((n_outputs,), -0.7))
    parameters = [*actor.parameters(), *critic.parameters(), deviations]
    optimizer = torch.optim.Adam(parameters, lr=1e-3, eps=1e-5)
    before = performance(actor)
    observations = torch.zeros((n_steps, n_rows, n_inputs))
    actions = torch.zeros((n_steps, n_rows, n_outputs))
    log_probabilities, rewards, dones, values = torch.zeros((4, n_steps, n_rows))
    following, done = torch.as_tensor(env.reset(seed=0)[0]), torch.zeros(n_rows)
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = 1e-3 * (1.0 - update / updates)
        for step in range(n_steps):
            observations[step], dones[step] = following, done
            with torch.no_grad():
                draws = torch.distributions.Normal(actor(following), deviations.exp())
                action = draws.sample()
                actions[step] = action
                log_probabilities[step] = draws.log_prob(action).sum(1)
                values[step] = critic(following).flatten()
            rows, reward, terminations, truncations, _ = env.step(action.numpy().clip(-1, 1))
            rewards[step] = torch.as_tensor(reward)
            following = torch.as_tensor(rows)
            done = torch.as_tensor((terminations | truncations).astype(np.float32))
        with torch.no_grad():
            advantages, last, value = (
                torch.zeros_like(rewards),
                torch.zeros(n_rows),
                critic(following),
            )
            following_value, is_going_on = value.flatten(), 1.0 - done
            for step in reversed(range(n_steps)):
                delta = rewards[step] + 0.99 * following_value * is_going_on - values[step]
                advantages[step] = last = delta + 0.99 * 0.95 * is_going_on * last
                following_value, is_going_on = values[step], 1.0 - dones[step]
            returns = (advantages + values).flatten()
        flat, taken = observations.flatten(0, 1), actions.flatten(0, 1)
        old, gained = log_probabilities.flatten(), advantages.flatten()
        for _ in range(4):
            for batch in torch.randperm(len(flat)).chunk(16):
                draws = torch.distributions.Normal(actor(flat[batch]), deviations.exp())
                ratio = (draws.log_prob(taken[batch]).sum(1) - old[batch]).exp()
                gain = (gained[batch] - gained[batch].mean()) / (gained[batch].std() + 1e-8)
                clipped = ratio.clamp(0.8, 1.2)
                error = critic(flat[batch]).flatten() - returns[batch]
                loss = -torch.min(gain * ratio, gain * clipped).mean() + 0.5 * error.square().mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimizer.step()
    env.close()
    steps = updates * n_steps * n_rows
    return "CleanRL's loop", f"SwarmRows, {steps:,} agent-steps", before, performance(actor)


def skrl_ppo(timesteps: int = 6_000) -> Row:
    """Learn by skrl's PPO on the same vector environment."""
    from skrl.agents.torch.ppo import PPO, PPO_CFG
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
    from skrl.trainers.torch import SequentialTrainer

    class Actor(GaussianMixin, Model):  # type: ignore[misc]  # skrl is not in the gate
        def __init__(self, *spaces: Any, device: Any) -> None:
            Model.__init__(self, observation_space=spaces[0], action_space=spaces[1], device=device)
            GaussianMixin.__init__(self, clip_actions=True)
            self.net = network(len(INPUTS), 3)
            self.log_std = nn.Parameter(torch.full((3,), -0.7))

        def compute(self, inputs: Any, role: str) -> Any:
            return self.net(inputs["observations"]), {"log_std": self.log_std}

    class Critic(DeterministicMixin, Model):  # type: ignore[misc]  # as above
        def __init__(self, *spaces: Any, device: Any) -> None:
            Model.__init__(self, observation_space=spaces[0], action_space=spaces[1], device=device)
            DeterministicMixin.__init__(self)
            self.net = network(len(INPUTS), 1)

        def compute(self, inputs: Any, role: str) -> Any:
            return self.net(inputs["observations"]), {}

    torch.manual_seed(0)
    env = wrap_env(SwarmRows(12, make_env=make_env, autoreset_mode="same_step"))
    spaces = env.observation_space, env.action_space
    models = {part: kind(*spaces, device=env.device) for part, kind in
              (("policy", Actor), ("value", Critic))}  # fmt: skip
    before = performance(models["policy"].net)
    memory = RandomMemory(memory_size=64, num_envs=env.num_envs, device=env.device)
    settings = PPO_CFG(rollouts=64, learning_epochs=4, mini_batches=8, learning_rate=1e-3)
    settings.experiment.write_interval = settings.experiment.checkpoint_interval = 0
    agent = PPO(models=models, memory=memory, cfg=settings, observation_space=spaces[0],
                action_space=spaces[1], device=env.device)  # fmt: skip
    trainer = SequentialTrainer(
        cfg={"timesteps": timesteps, "headless": True, "disable_progressbar": True},
        env=env,
        agents=agent,
    )
    trainer.train()
    steps = timesteps * env.num_envs
    after = performance(models["policy"].net)
    return "skrl PPO", f"SwarmRows, {steps:,} agent-steps", before, after


def maskable_ppo(steps: int = 400_000) -> Row:
    """Learn by sb3-contrib's MaskablePPO, which chooses among legal actions."""
    from sb3_contrib import MaskablePPO

    env = SwarmVecEnv(make_env=lambda _: DiscreteActions(make_env()), n_worlds=12, seed=0)
    model = MaskablePPO("MlpPolicy", env, n_steps=128, batch_size=576, n_epochs=4, seed=0,
                        learning_rate=1e-3, gamma=0.99)  # fmt: skip
    before = performance(model)
    model.learn(steps)
    return "MaskablePPO", f"SwarmVecEnv, {steps:,} agent-steps", before, performance(model)


def imitation_bc(episodes: int = 20) -> Row:
    """Clone homing by imitation's behavioural cloning, from recorded transitions."""
    from imitation.algorithms import bc
    from imitation.data.types import Transitions

    recorded = record("homing", episodes, scenario=WORLD, frame=True)
    observations, actions, following, ends = recorded.transitions()
    infos = np.array([{}] * len(actions))
    transitions = Transitions(observations, actions.clip(-1, 1), infos, following, ends)
    learner = bc.BC(
        observation_space=recorded.observation_space,
        action_space=recorded.action_space,
        demonstrations=transitions,
        rng=np.random.default_rng(0),
    )
    before = performance(learner.policy)
    learner.train(n_epochs=2, progress_bar=False)
    return (
        "imitation BC",
        f"{len(actions):,} decisions of homing",
        before,
        performance(learner.policy),
    )


def minari_set(episodes: int = 2) -> Row:
    """Record demonstrations as a Minari data set, and read them again."""
    import minari

    recorded = record("homing", episodes, scenario=WORLD, frame=True)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MINARI_DATASETS_PATH"] = folder
        recorded.to_minari("swarm-logistics/homing-v0", author="interop")
        data = minari.load_dataset("swarm-logistics/homing-v0")
        first = next(iter(data.iterate_episodes()))
        np.testing.assert_array_equal(first.observations, recorded.episodes[0].observations)
        what = f"{data.total_episodes} robots, {data.total_steps:,} decisions"
    p = float(np.mean(recorded.delivered))
    return "Minari", what, p, p


def pycma(evaluations: int = 300) -> Row:
    """Evolve a linear network of a few inputs by CMA-ES."""
    import cma

    names = ("requested_along", "requested_aside", "requested_present", "carrying_requested",
             "kept_home_along", "kept_home_aside", "whim_along", "whim_aside")  # fmt: skip
    columns = [INPUTS.index(name) for name in names]

    def outputs(weights: Any, rows: Any) -> Any:
        return np.tanh(rows[:, columns] @ weights.reshape(len(columns), 3) + [0.5, 0.0, 0.0])

    def cost(weights: Any, generation: int) -> float:
        policy = policies.of(lambda rows: outputs(weights, rows), frame=True)
        seeds = (generation, generation + 1)
        return -float(np.mean([run_episode(WORLD, policy, seed).delivered for seed in seeds]))

    start = np.zeros(3 * len(columns))
    before = performance(lambda rows: outputs(start, rows))
    search = cma.CMAEvolutionStrategy(start, 1.0, {"seed": 1, "verbose": -9})
    while search.countevals < evaluations:
        candidates = search.ask()
        search.tell(candidates, [cost(weights, search.countiter) for weights in candidates])
    best = search.result.xfavorite
    after = performance(lambda rows: outputs(best, rows))
    return "pycma", f"{search.countevals} evaluations of 2 episodes", before, after


LEARNERS: tuple[Callable[[], Row], ...] = (
    cleanrl_loop, skrl_ppo, maskable_ppo, imitation_bc, minari_set, pycma,
)  # fmt: skip


def rows() -> Iterator[tuple[str, ...]]:
    """Yield the row of each learner: its name, what it took, P before and after, its time."""
    for learner in LEARNERS:
        start = time.monotonic()
        name, what, before, after = learner()
        seconds = time.monotonic() - start
        yield name, what, f"{before:.1f}", f"{after:.1f}", f"{seconds:.0f} s"


def main() -> None:
    """Print a table of all."""
    print("| learner | what it took | P before | P after | time |")
    print("| --- | --- | --- | --- | --- |")
    for row in rows():
        print(f"| {' | '.join(row)} |", flush=True)
    homing = [run_episode(WORLD, policies.load("homing"), seed).delivered for seed in SEEDS]
    print(f"homing delivers {np.mean(homing):.1f} there; {len(SEEDS)} seeds.")


if __name__ == "__main__":
    main()
