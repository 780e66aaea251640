import sys, numpy as np
from swarm_logistics_env import policies
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.core.streams import row_keys
sc = Training(scenario=dict(preset="realistic", restock=True)).scenario
def use(name, seeds):
    tot = np.zeros(8); nn=[]; depth=[]; P=[]
    for seed in seeds:
        p = policies.load(name); w = Warehouse(sc); o = w.reset(seed=seed)
        p.configure(sc); p.reset(sc.n_robots, seed)
        st = w.state; last=None; t0=0; lifted=None; lifts=0
        step=0
        while not w.is_over_time:
            a = p.act(o, st) if getattr(p, "needs_state", False) else p.act(o)
            o = w.step(a)
            st = w.state; r = st.requested; step+=1
            key=(r, st.delivered)
            if key != last:
                if last is not None and last[0]>=0:
                    T=st.time-t0
                    tot[0]+=1
                    if held: tot[1]+=1; tot[2]+=T
                    else:
                        tot[3]+=(lifted if lifted is not None else st.time)-t0; tot[4]+=T-((lifted if lifted is not None else st.time)-t0); tot[5]+=lifts; tot[6]+= lifts>1; tot[7]+= T if lifts>1 else 0
                last=key; t0=st.time; lifted=None; lifts=0
                c = st.item_carrier[r] if r>=0 else -1
                held = c>=0
                prev=c
            c = st.item_carrier[r]
            if not held and c>=0 and prev<0:
                lifts+=1
                if lifted is None: lifted=st.time
            prev=c
            if step%500==0:
                free = st.item_carrier<0
                pos = st.item_position[free]
                d = np.hypot(*(pos[:,None]-pos[None]).transpose(2,0,1)); np.fill_diagonal(d,9)
                x = w.floor.edge - w.floor.along(pos)
                near = (x>0)&(x<2.5)
                nn += d[near].min(1).tolist(); depth.append([near.sum(), (x<=0).sum(), (~free).sum(), (x>2.5).sum()])
        P.append(st.delivered)
    n=tot[0]; nh=n-tot[1]
    print(f"{name[-40:]}: P {np.mean(P):.1f}; held {tot[1]/n:.2f} in {tot[2]/max(tot[1],1):.1f} s; others: first lift {tot[3]/nh:.1f} s, then {tot[4]/nh:.1f} s; lifts {tot[5]/nh:.2f}, several {tot[6]/nh:.2f} of {tot[7]/max(tot[6],1):.1f} s; near nn median {np.median(nn):.2f}, <.5: {np.mean(np.array(nn)<.5):.2f}; near/inside/carried/far {np.mean(depth,0).round(1)}", flush=True)
for n in sys.argv[1:]: use(n, range(480000, 480006))
