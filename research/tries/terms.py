import numpy as np
def crowding(world, before, after):
    earned = np.zeros(len(after.robot_position))
    changed = np.flatnonzero((after.carriers < 0) != (before.carriers < 0))
    for i in changed:
        put = after.carriers[i] < 0
        robot = before.carriers[i] if put else after.carriers[i]
        place = after.item_position[i] if put else before.item_position[i]
        if put and np.hypot(*(place - after.robot_position[robot])) > 0.5:
            continue  # delivered
        free = after.carriers < 0
        free[i] = False
        if not free.any():
            continue
        away = np.hypot(*(after.item_position[free] - place).T).min()
        c = max(0.0, 0.6 - away) / 0.6
        earned[robot] += -c if put else c
    return earned
