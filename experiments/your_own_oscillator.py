# ---
# jupyter:
#   jupytext:
#     formats: py:percent,ipynb
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---
# %% [markdown]
# # Bring your own oscillator
# Everything here takes any system that is forced once in a revolution. Ueda's and a double-well oscillator in three
# lines each: exponents, orbits, the cascade of period doublings, and how its first point answers to the parameters.

# %%
import jaxcage as jc  # before jax: it keeps XLA from talking of kept programs


# isort: split
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from _size import save, small

from jaxcage.show import new_figure


jc.enable_x64()


# %%
class DoubleWell(eqx.Module):
    cubic: jax.Array
    force: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.3 * u + x - self.cubic * x**3 + self.force * jnp.cos(tau),)


make = lambda force: jc.ForcedOscillator(DoubleWell(jnp.asarray(1.0), jnp.asarray(force)), coordinates=1)
method = jc.method("rodas4", steps=64)

# %% [markdown]
# Strobe points and the largest exponent over the force: a cascade into chaos.

# %%
forces = np.linspace(0.20, 0.50, small(400, 48))
one = dict(initial_states=[(0.4, 0.3)], discard=small(300, 50), revolutions=small(200, 40), blocks=10, method=method)
swept = jc.sweep([make(f) for f in forces], np.array([1.2]), **one).isel(speed=0, initial_state=0)
exponent = swept["exponents"].values[:, 0]
print(f"{np.mean(exponent > 0.02):.0%} of the forces are chaotic; largest exponent {exponent.max():.3f} per revolution")

# %%
orbit = jc.periodic_orbit(make(0.26), 1.2, guess=(1.0, 0.0), revolutions=100, method=method)
point = jc.bifurcation(make(0.26), "period-doubling", orbit, "force", speed=1.2, method=method)
slope = eqx.filter_grad(lambda s: jc.bifurcation(s, "period-doubling", orbit, "force", speed=1.2, method=method).value)(
    make(0.26)
)
print(
    f"the period doubles at a force of {float(point.value):.6f}; elasticity by the cubic term "
    f"{float(slope.acceleration.cubic / point.value):+.6f} (exactly -1/2)"
)

# %%
figure = new_figure(10.0, 5.0)
above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
strobe = swept["strobe"].isel(component=0).values
above.plot(np.repeat(forces, strobe.shape[1]), strobe.ravel(), ",", color="#0072B2")
above.axvline(float(point.value), color="#D55E00", linewidth=0.8)
above.set_ylabel("x at phase 0")
below.plot(forces, exponent, color="#0072B2", linewidth=0.9)
below.axhline(0, color="black", linewidth=0.6)
below.set(xlabel="Force", ylabel="Largest exponent\nper revolution")
save(figure, "your_own_oscillator")
