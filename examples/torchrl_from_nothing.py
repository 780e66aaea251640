"""TorchRL learns from nothing on the frame of motion: its collector, its PPO, one shared network.

Needs `pip install torchrl`.
"""

from typing import Any

import torch
from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import PettingZooWrapper
from torchrl.modules import ProbabilisticActor, TanhNormal
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from swarm_logistics_env import Scenario, policies, run_episode, swarm_logistics_v0
from swarm_logistics_env.motion import INPUTS
from swarm_logistics_env.wrappers import MotionFrame

REWARDS = {
    "own_delivery": 1.0, "lift_requested": 0.5, "approach": 0.1, "stocking": 0.1, "contact": -0.05
}  # fmt: skip
SMALL: dict[str, Any] = {"warehouse_width": 6.0, "warehouse_height": 5.0, "delivery_width": 1.5}
N_ROBOTS, STEPS, EPOCHS, BATCH = 10, 2000, 4, 125


def network(n_outputs):
    hidden = [nn.Linear(len(INPUTS), 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()]
    return nn.Sequential(*hidden, nn.Linear(64, n_outputs))


def main(total_frames=100_000, duration=200.0, seed=0, judged=10):
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    scenario = Scenario(n_robots=N_ROBOTS, n_items=8, restock=True, duration=duration, **SMALL)
    env = MotionFrame(swarm_logistics_v0.parallel_env(scenario, rewards=REWARDS))
    wrapped = PettingZooWrapper(env, group_map={"robots": env.possible_agents}, seed=seed)
    # One network for all robots. Untrained it drives ahead: who trembles on the spot meets nothing.
    layers = network(3)
    nn.init.orthogonal_(layers[-1].weight, 0.01)
    layers[-1].bias.data[0] = 1.1
    # The floor under the noise: where it dies out, learning ends long before the policy is good.
    noise = AddStateIndependentNormalScale(3, scale_mapping="biased_softplus_0.6", scale_lb=0.3)
    parts = [("robots", "loc"), ("robots", "scale")]
    actor = ProbabilisticActor(
        TensorDictModule(nn.Sequential(layers, noise), [("robots", "observation")], parts),
        in_keys=parts,
        out_keys=[("robots", "action")],
        distribution_class=TanhNormal,
        return_log_prob=True,
        log_prob_key=("robots", "log_prob"),
    )
    value = ("robots", "state_value")
    critic = TensorDictModule(network(1), [("robots", "observation")], [value])
    ppo = ClipPPOLoss(actor, critic, entropy_coeff=0.0, normalize_advantage=True)
    ppo.set_keys(
        reward=("robots", "reward"), action=("robots", "action"), value=value,
        done=("robots", "done"), terminated=("robots", "terminated"),
        sample_log_prob=("robots", "log_prob"),
    )  # fmt: skip
    ppo.make_value_estimator(ValueEstimators.GAE, gamma=0.99, lmbda=0.95)
    optimizer = torch.optim.Adam(ppo.parameters(), lr=1e-3)
    collector = Collector(wrapped, actor, frames_per_batch=STEPS, total_frames=total_frames)
    for batch in collector:
        with torch.no_grad():
            ppo.value_estimator(batch)
        for _ in range(EPOCHS):
            for some in torch.randperm(STEPS).split(BATCH):
                losses = ppo(batch[some])
                optimizer.zero_grad()
                (losses["loss_objective"] + losses["loss_critic"]).backward()
                nn.utils.clip_grad_norm_(ppo.parameters(), 0.5)
                optimizer.step()
    # P of what was learned and of Swarm D-T on the same seeds, which nothing was learned on.
    seeds, own = range(1000, 1000 + judged), []
    for judging in seeds:
        begun = wrapped.reset(seed=judging)
        with torch.no_grad():
            wrapped.rollout(scenario.n_steps, actor, auto_reset=False, tensordict=begun)
        own.append(env.warehouse.state.delivered)
    scripted = [run_episode(scenario, policies.load("swarm-dt"), s).delivered for s in seeds]
    collector.shutdown()
    print(f"P on {judged} seeds: {own}; Swarm D-T's on the same: {scripted}")
    return own, scripted


if __name__ == "__main__":
    main()
