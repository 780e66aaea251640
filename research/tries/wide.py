"""tune.py NAME STEPS [START]: PPO goes on from a policy file in realistic, with rewards by NAME."""
import sys, time, types, json
import numpy as np, torch
from pathlib import Path
from swarm_logistics_env.train import trainer, training_callback
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.policies import load
from swarm_logistics_env import policies
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.train.evaluation import performances

name, steps = sys.argv[1], int(float(sys.argv[2]))
start = sys.argv[3] if len(sys.argv) > 3 else "ppo-robust@1"
base, _, suffix = name.partition("-")
rewards = dict(own_delivery=.5, delivery=.5, lift_requested=.3, approach=.15, stocking=.15,
               blocked_request=-.5, contact=-.06, collision=-.15)
rewards |= {
    "F0": {}, "F1": dict(held_inside=.3), "F2": dict(stocking=.05), "F3": dict(contact=-.02, collision=-.05),
    "F4": dict(contact=-.001, collision=-.001), "F5": dict(own_delivery=.1, delivery=.9),
    "F6": dict(own_delivery=1., delivery=.5, lift_requested=.5), "F7": dict(held_inside=.3, stocking=.05), "H1": {"tries/terms.py:crowding": .3}, "H2": {"tries/terms.py:crowding": 1.0},
}[base]
from safetensors.numpy import load_file
from swarm_logistics_env.policies.learned import Network
import swarm_logistics_env
weights = Path(swarm_logistics_env.__file__).parent / "policies/weights" / (start + ".safetensors")
class policy:
    tensors = load_file(str(weights))
network = Network(hidden=[128, 64], decides_every=2, exploration=1.0, role="R" in name)
ppo = dict(n_steps=64, n_minibatches=16, epochs=3, learning_rate=3e-4, final_learning_rate=2e-5, gamma=.99,
           target_kl=.02, value_hidden=[128, 128], clip=.2)
if not network.says_classes:
    ppo |= dict(deviations=[.2, .2, .2], least_deviation=[.2, .2], least_until=.5)
if "g" in suffix: ppo["gamma"] = .997
if "b" in suffix: ppo |= dict(n_steps=256, n_minibatches=32)
if "l" in suffix: ppo |= dict(gae_lambda=.98)
if "n" in suffix: ppo |= dict(deviations=[.15]*3, least_deviation=[.15, .1])
if "r" in suffix: ppo |= dict(learning_rate=1e-3, final_learning_rate=3e-5)
conds = []
training = Training(
    name=f"tune-{name}", agent_steps=steps, scenario=dict(preset="realistic", restock=True),
    worlds=[dict(count=24, n_robots=25)], rewards=rewards, network=network.model_dump(), ppo=ppo, threads=1,
    evaluation=dict(every=2_000_000, seeds=8), scores=dict(seeds=0), seed=0)
WARM = 25

def begin(training, learner, log, rng):
    p = learner.policy
    t = policy.tensors
    hidden = [m for m in p.mlp_extractor.policy_net if isinstance(m, torch.nn.Linear)]
    with torch.no_grad():
        for i, linear in enumerate([*hidden, p.action_net]):
            w = torch.tensor(t[f"layers.{i}.weight"]); linear.weight.zero_(); linear.weight[:, :w.shape[1]] = w; linear.bias.copy_(torch.tensor(t[f"layers.{i}.bias"]))
        if "deviations" in t:
            p.log_std.copy_(torch.tensor(t["deviations"]).log())
            print("deviations", t["deviations"])
trainer.imitate = begin
old = training_callback.TrainingCallback._on_rollout_start
def start_rollout(self):
    old(self)
    n = self.num_timesteps // (self._training.rows * self._training.ppo.n_steps)
    for q in self.model.policy.actor_parameters():
        q.requires_grad_(n >= WARM)
training_callback.TrainingCallback._on_rollout_start = start_rollout
out = Path("results/tries") / name
t0 = time.monotonic()
path = trainer.train(training, out, device="cpu")
print(name, "minutes", (time.monotonic() - t0) / 60, "cpu", time.process_time() / 60)
sc = Scenario(preset="realistic", restock=True) if False else training.evaluation_scenario
for f in (path, out / "best.safetensors"):
    p = performances(policies.load(str(f)), sc, [()], range(480000, 480016))[0]
    print(name, f.name, round(p.mean(), 1), "+-", round(p.std(ddof=1) / 4, 1), flush=True)
