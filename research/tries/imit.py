"""imit.py NAME DECISIONS STEPS [KEY=VALUE..]: the preset taught, from imitation on."""
import sys, time, json
import numpy as np
from pathlib import Path
from swarm_logistics_env.train import trainer
from swarm_logistics_env.train.training import Training
from swarm_logistics_env import policies
from swarm_logistics_env.train.evaluation import performances
name, decisions, steps = sys.argv[1], int(float(sys.argv[2])), int(float(sys.argv[3]))
rewards = dict(own_delivery=.5, delivery=.5, lift_requested=.3, approach=.15, held_inside=.3, blocked_request=-.5, contact=-.03, collision=-.05)
ppo = dict(n_steps=64, n_minibatches=16, epochs=3, learning_rate=3e-4, final_learning_rate=2e-5, gamma=.995, clip=.15, target_kl=.015, value_hidden=[128, 128])
teacher = dict(policy="homing-stock", decisions=decisions, shares=[1.0, .3], noise=.15, rate=1e-3, epochs=10, warm_up=30, pull=.1, pull_until=.5)
network = dict(hidden=[128, 128], role=True, decides_every=2, head="classes", exploration=.5)
every = 1_000_000
for word in sys.argv[4:]:
    key, value = word.split("=")
    for table in (rewards, ppo, teacher, network):
        if key in table or (table is rewards and key in ("stocking",)): table[key] = json.loads(value)
training = Training(name="taught", agent_steps=max(steps, 1), scenario=dict(preset="realistic", restock=True), keep="last",
    worlds=[dict(count=12, n_robots=25)], rewards=rewards, threads=1, network=network, teacher=teacher, ppo=ppo,
    evaluation=dict(every=every, seeds=8), scores=dict(seeds=0), seed=0)
out = Path("results/tries") / name
t0 = time.monotonic()
path = trainer.train(training, out, device="cpu")
print(name, "minutes", (time.monotonic() - t0) / 60, "cpu", time.process_time() / 60)
print((out / "curve.csv").read_text())
for f in (path, out / "best.safetensors"):
    p = performances(policies.load(str(f)), training.evaluation_scenario, [()], range(480000, 480016))[0]
    print(name, f.name, round(p.mean(), 1), "+-", round(p.std(ddof=1) / 4, 1), flush=True)
