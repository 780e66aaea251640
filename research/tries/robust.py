"""robust.py NAME STEPS: the recipe robust at another length, evaluated as the others."""
import sys, time
from pathlib import Path
from swarm_logistics_env.train import trainer
from swarm_logistics_env.train.training import Training
from swarm_logistics_env import policies
from swarm_logistics_env.train.evaluation import performances
import tomllib, swarm_logistics_env
name, steps = sys.argv[1], int(float(sys.argv[2]))
spec = tomllib.loads((Path(swarm_logistics_env.__file__).parent / "train/presets/robust.toml").read_text())
spec |= dict(agent_steps=steps, threads=1, scores=dict(seeds=0), evaluation=dict(every=4_000_000, seeds=8), name="robust-pilot")
for w in sys.argv[3:]:
    if w == "role": spec["network"]["role"] = True
    if w == "held": spec["rewards"]["held_inside"] = .3
training = Training(**spec)
out = Path("results/tries") / name
t0 = time.monotonic()
path = trainer.train(training, out, device="cpu")
print(name, "minutes", (time.monotonic() - t0) / 60, "cpu", time.process_time() / 60)
print((out / "curve.csv").read_text())
for f in (path, out / "best.safetensors"):
    p = performances(policies.load(str(f)), training.evaluation_scenario, [()], range(480000, 480016))[0]
    print(name, f.name, round(p.mean(), 1), "+-", round(p.std(ddof=1) / 4, 1), flush=True)
