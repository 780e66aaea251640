"""How kernels are compiled and worlds are laid out in memory: all that knows numba's insides."""
