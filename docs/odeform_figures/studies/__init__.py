"""Studies of simulations: convergence, and motions beyond the trained window beside longer simulations."""
