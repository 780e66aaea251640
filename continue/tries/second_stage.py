import sys
from swarm_logistics_env.train import trainer as T
from swarm_logistics_env.train.learner import read_checkpoint
from swarm_logistics_env.train.training import load_training
from pathlib import Path
name, source = sys.argv[1:3]
make = T.make_learner
def started(training, view, device):
    learner = make(training, view, device)
    state = read_checkpoint(Path(source))
    learner.policy.load_state_dict(state["policy"])
    return learner
T.make_learner = started
T.train(load_training(f"{name}.toml"), name, command="x")
