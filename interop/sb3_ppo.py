"""PPO of stable-baselines3 on `SwarmVecEnv`: python -m interop.sb3_ppo --seed 0."""

from __future__ import annotations

import math

from stable_baselines3 import PPO

from interop.small_world import SETTINGS, Learning, Tensors, drive_ahead, main, make_env, tensors_of
from swarm_logistics_env.adapters import SwarmVecEnv


def learn(learning: Learning) -> Tensors:
    """Train; see `small_world.main`."""
    env = SwarmVecEnv(
        make_env=lambda _: make_env(learning.scenario),
        n_worlds=learning.n_worlds,
        seed=learning.seed,
    )
    network = {"net_arch": list(SETTINGS.hidden), "log_std_init": math.log(SETTINGS.deviation)}
    model = PPO(
        "MlpPolicy",
        env,
        learning_rate=lambda left: left * SETTINGS.learning_rate,
        n_steps=SETTINGS.n_steps,
        batch_size=learning.rows * SETTINGS.n_steps // SETTINGS.n_minibatches,
        n_epochs=SETTINGS.epochs,
        gamma=SETTINGS.gamma,
        gae_lambda=SETTINGS.gae_lambda,
        clip_range=SETTINGS.clip,
        max_grad_norm=SETTINGS.max_grad_norm,
        policy_kwargs=network,
        seed=learning.seed,
        device="cpu",
    )
    policy = model.policy
    parts = [*policy.mlp_extractor.policy_net.parameters(), *policy.action_net.parameters()]
    drive_ahead(parts)

    def learned() -> Tensors:
        return tensors_of(parts, policy.log_std.exp())

    def tell(*_: object) -> bool:
        learning.tell(model.num_timesteps, learned)
        return True

    model.learn(learning.agent_steps, callback=tell)
    return learned()


if __name__ == "__main__":
    main(learn, ["sb3-ppo"])
