import sys
name, collision, contact, gamma, steps = sys.argv[1:6]
small = 'warehouse_width = 6.0, warehouse_height = 5.0, delivery_width = 1.5, n_items = 8, duration = 200.0'
mid = 'warehouse_width = 8.0, warehouse_height = 7.0, delivery_width = 1.8, n_items = 22, duration = 300.0'
def cond(bodies, head="    "):
    FA='modes = ["FM1", "FM2", "FM3", "FM4", "FM4", "FM4_jam"], robots = [1, 2, 3]'
    LATE='modes = ["FM1", "FM2", "FM4", "FM4_jam", "motor_slow", "motor_dead", "view_reduced", "rangers_blind", "dead"], robots = [1, 2, 3], onset = [0.0, 300.0]'
    rows=[]
    for w,f in ((0.5,''),(0.3,FA),(0.2,LATE)):
        for share,b in bodies:
            part=[f"weight = {w*share:g}"]+([f] if f else [])+([f"scenario = {{ {b} }}"] if b else [])
            rows.append("{ "+", ".join(part)+" }")
    return rows
OTHER='drive = ["holonomic", "differential"], max_speed = [0.5, 1.0, 2.0], max_acceleration = [1.0, 2.0, 5.0, 20.0], handling_time = [0.0, 0.5, 1.0, 2.0, 3.0], heading_drift = [0.02, 0.05, 0.1]'
PAPER='heading_drift = [0.02, 0.02, 0.1], handling_time = [0.0, 0.0, 1.0], max_speed = [1.0, 2.0, 2.0], drive = ["holonomic", "holonomic", "differential"]'
out=[f'''name = "{name}"
about = "PPO from nothing on robots that could exist, and on those of the paper: both drives, 0.5 to 2 m/s, 1 to 20 m/s2, 0 to 3 s of lifting, noise and losses; small and large rooms, obstacles, racks, 3 to 100 robots, 8 to 200 items; robots fail in half of the episodes."
agent_steps = {steps}
scenario = {{ preset = "realistic", restock = true }}
threads = 1
''']
def world(count,n,scen=None,conds=None,note=None):
    if note: out.append("# "+note)
    out.append(f"[[worlds]]\ncount = {count}\nn_robots = {n}")
    if scen: out.append(f"scenario = {{ {scen} }}")
    if conds: out.append("conditions = [\n"+"".join(f"    {c},\n" for c in conds)+"]")
    out.append("")
paper='preset = "paper", restock = true'
world(5,10,small,note="Small rooms, in which a robot meets the requested item by chance.")
world(4,3,small)
world(2,12,mid)
world(4,4,mid)
world(3,3,note="The room of the paper, with few robots and with many.")
world(5,5)
world(4,10)
world(8,25)
world(1,50)
world(1,100)
world(2,10,paper+", "+small,cond([(1,PAPER)]),note="The robots of the paper, who lift in no time.")
world(2,5,paper,cond([(1,PAPER)]))
world(1,10,paper,cond([(1,PAPER)]))
world(3,25,paper,cond([(1,PAPER)]))
world(1,50,paper,cond([(1,PAPER)]))
world(1,25,"warehouse_width = 20.0",note="Larger rooms, more items, obstacles, racks.")
world(1,25,"warehouse_width = 20.0, warehouse_height = 20.0")
world(1,25,"n_items = 120")
world(2,25,"n_obstacles = 10")
world(1,25,"n_obstacles = 20")
world(2,25,'floor = "aisles"')
world(1,25,'floor = "two_docks"')
world(1,25,'floor = "bottleneck"')
out.append("# Where a world says nothing else: half of the episodes as the preset has them, half with other bodies and hands.")
for c in cond([(0.5,''),(0.5,OTHER)]):
    body=c[2:-2]
    # split top-level commas
    parts=[];d=0;cur=''
    for ch in body:
        if ch in '[{': d+=1
        if ch in ']}': d-=1
        if ch==',' and d==0: parts.append(cur.strip()); cur=''
        else: cur+=ch
    parts.append(cur.strip())
    out.append("[[conditions]]\n"+"\n".join(parts)+"\n")
out.append(f'''[rewards]
own_delivery = 0.5
delivery = 0.5
lift_requested = 0.3
approach = 0.15
stocking = 0.03
blocked_request = -0.5
contact = {contact}
collision = {collision}

[network]
hidden = [128, 64]
decides_every = 2
exploration = 1.0

[ppo]
n_steps = 64
n_minibatches = 16
epochs = 3
learning_rate = 1e-3
final_learning_rate = 5e-5
gamma = {gamma}
target_kl = 0.03
deviations = [0.5, 0.5, 0.4]
least_deviation = [0.4, 0.2]
least_until = 0.5
value_hidden = [128, 64]

[evaluation]
every = 2000000
faults = {{ FM4 = 3, FM4_jam = 3 }}

[scores]
seeds = 0
''')
open(f"{name}.toml","w").write("\n".join(out))
