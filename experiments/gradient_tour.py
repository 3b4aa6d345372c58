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
# # A tour of gradients
# 1. An edge of a zone is a bifurcation of the synchronous orbit: it has equations, and so an exact gradient.
# 2. The largest Floquet multiplier has one too, on either side of the edge.
# 3. A chaotic trajectory has none that is worth having: its derivative explodes.

# %%
import jaxcage as jc  # before jax: it keeps XLA from talking of kept programs


# isort: split
import jax
import jax.numpy as jnp
from _size import save, small

from jaxcage.show import elasticity_bars, new_figure


jc.enable_x64()
model = jc.case("1a")

# %% [markdown]
# The synchronous orbits around 12500 rpm, found without a hint, and the bifurcation at which the calm stretch begins.

# %%
orbits = jc.synchronous_orbits(model, jc.rpm(12000), jc.rpm(13000), count=21, discard=1500)
print(orbits)
edge = next(p for p in orbits.edges if p.kind == "period-doubling")

# %%
exact = jc.sensitivity(model, edge, f"lower edge of the calm stretch ({edge.kind})")
print(exact)
print("homogeneity", {k: f"{v:.1e}" for k, v in exact.homogeneity.items()})

# %% [markdown]
# The same number from two edges that are solved anew, with a gap that is a little smaller and a little larger:

# %%
step = 1e-6
around = [jc.sensitivity(jc.replace(model, guidance_gap=0.45e-3 * (1 + s * step)), edge) for s in (1, -1)]
difference = (around[0].value_rpm - around[1].value_rpm) / (2 * step * exact.value_rpm)
print(f"elasticity by the gap: {exact.elasticity['guidance_gap']:+.7f}, by differences {difference:+.7f}")

# %%
figure = new_figure(9.0, 4.5)
elasticity_bars([exact], figure.subplots())
save(figure, "gradient_tour")

# %% [markdown]
# Through chaos: the derivative of a mean over n revolutions by the gap grows like e^(lambda n).

# %%
chaotic = float(jc.rpm(11000.0))
for n in (10, 40, 80)[: small(3, 2)]:

    def mean_square(gap, n=n):
        strobe = jc.strobe_map(jc.replace(model, guidance_gap=gap), chaotic)
        start = tuple(jnp.asarray(c, dtype=float) for c in model.initial_states(chaotic)[0])
        advance = lambda y, _: (strobe(y).y, y[0] ** 2)
        return jnp.mean(jax.lax.scan(advance, start, None, n)[1])

    print(f"{n} revolutions: {float(jax.jit(jax.jacfwd(mean_square))(0.45e-3)):+.3e}")
