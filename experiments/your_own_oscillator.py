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
# # At which force does a double-well oscillator become chaotic?
# The analysis takes any system that is forced once in a revolution. Here it is an oscillator with two wells, written
# in three lines. A sweep shows where it becomes chaotic. The cascade of period doublings that leads there gives the
# force to many digits, and a derivative with respect to a parameter, which a scaling law checks.

# %%
import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxcage as jc


jc.keep_compiled_programs()
jc.enable_x64()


# %%
class DoubleWell(eqx.Module):
    cubic: jax.Array
    force: jax.Array

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.3 * u + x - self.cubic * x**3 + self.force * jnp.cos(tau),)


def oscillator(force, cubic=1.0):
    return jc.ForcedOscillator(DoubleWell(jnp.asarray(cubic), jnp.asarray(force)), coordinates=1)


SPEED = 1.2  # of the forcing
method = jc.method("rodas4", steps=64)

# %% [markdown]
# ## Settings of this page

# %% tags=["parameters"]
FORCES = 400  # number of forces in the sweep
DISCARD = 300  # revolutions before those that are shown
REVOLUTIONS = 200  # revolutions that are shown

# %% [markdown]
# ## The first period doubling
# An orbit in the right well is followed to the force at which its period doubles.

# %%
orbit = jc.periodic_orbit(oscillator(0.26), SPEED, guess=(1.0, 0.0), revolutions=100, method=method)


def doubling(system):
    return jc.bifurcation(system, "period-doubling", orbit, "force", speed=SPEED, method=method)


first = doubling(oscillator(0.26))
slope = jax.grad(lambda system: doubling(system).value)(oscillator(0.26))
elasticity = float(slope.acceleration.cubic / first.value)
print(f"the period doubles at a force of {float(first.value):.8f} ± {float(first.error):.0g}")
print(f"elasticity with respect to the cubic term {elasticity:.8f}")

# %% [markdown]
# ## The cascade
# The doubled orbit doubles again, and so on. The distances shrink by Feigenbaum's ratio, 4.6692; where they add up to,
# chaos begins. The last two sums tell the error.

# %%
values = [float(first.value)]
for periods, force in ((2, 0.284), (4, 0.2905), (8, 0.2918)):
    near = jc.periodic_orbit(
        oscillator(force), SPEED, guess=(1.0, 0.0), periods=periods, revolutions=400, method=method
    )
    values.append(
        float(jc.bifurcation(oscillator(force), "period-doubling", near, "force", speed=SPEED, method=method).value)
    )
distances = np.diff(values)
sums = values[1:] + distances / (4.6692 - 1)
print("the period doubles at", *np.round(values, 7))
print("ratios of the distances:", *(distances[:-1] / distances[1:]).round(3))
print(f"chaos begins at a force of {sums[-1]:.7f} ± {abs(sums[-1] - sums[-2]):.0g}")

# %% [markdown]
# ## The sweep
# Points are the position once in a revolution, from one initial state; the exponent below is positive in chaos.

# %%
forces = np.linspace(0.20, 0.50, FORCES)
one = dict(initial_states=[(0.4, 0.3)], discard=DISCARD, revolutions=REVOLUTIONS, blocks=10, method=method)
swept = jc.sweep([oscillator(f) for f in forces], np.array([SPEED]), **one).isel(speed=0, initial_state=0)
exponent = swept["exponents"].values[:, 0]
print(f"{np.mean(exponent > 0.02):.0%} of the forces are chaotic; largest exponent {exponent.max():.2f} per revolution")

figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(2, 1), figsize=(10, 5), layout="constrained")
strobe = swept["strobe"].isel(component=0).values
above.plot(np.repeat(forces, strobe.shape[1]), strobe.ravel(), ",", color="#0072B2")
below.plot(forces, exponent, color="#0072B2", linewidth=0.9)
below.axhline(0, color="black", linewidth=0.6)
for ax in (above, below):
    ax.axvline(values[0], color="#D55E00", linewidth=0.8, label="first period doubling")
    ax.axvline(sums[-1], color="#009E73", linewidth=0.8, label="end of the cascade")
above.set_ylabel("Position x [1]")
above.legend(loc="lower right", fontsize=8)
below.set(xlabel="Force [1]", ylabel="Largest exponent\nper revolution")
plt.show()

# %% [markdown]
# ## The scaling law
# With x √c in place of x the cubic term c drops out of the equation, and the force becomes force · √c. The force at
# the period doubling must therefore be proportional to c to the power -1/2.

# %%
cubics = np.linspace(0.9, 1.1, 5)
forces_at = [float(doubling(oscillator(0.26, cubic)).value) for cubic in cubics]
figure, ax = plt.subplots(figsize=(7, 4), layout="constrained")
ax.plot(cubics, forces_at, "o", label="solved for")
c = np.linspace(0.9, 1.1, 50)
ax.plot(c, values[0] / np.sqrt(c), "-", label="scaling law")
ax.plot(c, values[0] * (1 + elasticity * (c - 1)), "--", label="derivative at c = 1")
ax.set(xlabel="Cubic term c [1]", ylabel="Force at the period doubling [1]")
ax.legend(frameon=False)
plt.show()

# %% [markdown]
# ## Conclusion
# Chaos begins at a force of 0.2922875 ± 0.0000007, where the cascade ends; in the sweep the exponent passes zero
# there. The first period doubling is at 0.2655818 ± 0.0000003, and its elasticity with respect to the cubic term is
# -1/2 to eight digits, as the scaling law demands.
