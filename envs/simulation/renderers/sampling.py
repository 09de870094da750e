"""Textures under trilinear and anisotropic filtering, for many fragments at once.

Bilinear weights have eight bits, as in graphics hardware, so that whole numbers do: two texels
share a 32-bit word, and one multiplication weighs both. The loops have no branches.
"""

from typing import Any

import numpy as np

from grouser.kernels import inlined, kernel

F, N, U = np.float32, np.int32, np.uint32
_PAIR, _LOW, _SHIFT, _BYTE = U(0x00FF00FF), U(0xFFFF), U(8), U(256)


@kernel
def sample(bank: Any, fragments: Any, n: int) -> None:
    """Fill in the values of the first n fragments.

    Args:
        bank: a `TextureBank`.
        fragments: `Fragments`.
    """
    most = 1
    for k in range(n):
        most = max(most, int(fragments.taps[k]))
    for q in range(bank.channels):
        for tap in range(most):
            _add_tap(bank, fragments, n, q, tap)


@kernel
def _add_tap(bank: Any, fragments: Any, n: int, channel: int, tap: int) -> None:
    """Add one tap of each fragment that has so many."""
    u, v, step_u, step_v = (
        fragments.u[:n],
        fragments.v[:n],
        fragments.step_u[:n],
        fragments.step_v[:n],
    )
    bits = fragments.width[:n].view(np.int32)
    taps, texture, value = fragments.taps[:n], fragments.texture[:n], fragments.value[channel, :n]
    offsets, sizes, texels = bank.offsets, bank.sizes, bank.texels
    channels = N(bank.channels)
    first, scale = tap == 0, F(1 / 65536)
    for k in range(u.size):
        # A float's exponent is the level, its next eight bits the way to the level after.
        level = N((bits[k] >> N(23)) - N(127))
        blend = U((bits[k] >> N(15)) & N(255))
        side = N(sizes[texture[k]] >> level)
        away = F(tap) - F(0.5) * (taps[k] - F(1))
        # One tile further, so that conversion to an integer rounds down.
        a, b = u[k] + away * step_u[k] + F(1), v[k] + away * step_v[k] + F(1)
        fine = _bilinear(texels, offsets[texture[k], level], side, channels, channel, a, b)
        coarse = _bilinear(
            texels, offsets[texture[k], level + 1], N(side >> N(1)), channels, channel, a, b
        )
        blended = U(U(U(_BYTE - blend) * fine) + U(blend * coarse))
        added = F(N(blended)) * scale if F(tap) < taps[k] else F(0)
        value[k] = added if first else value[k] + added


@inlined
def _bilinear(
    texels: Any, offset: Any, side: Any, channels: Any, channel: int, a: Any, b: Any
) -> Any:
    """256 times the texture at tile coordinates (a, b) on a level."""
    last, fine = N(side - N(1)), F(side) * F(256)
    x, y = N(a * fine - F(128)), N(b * fine - F(128))
    column, row = N((x >> N(8)) & last), N((y >> N(8)) & last)
    index = N(offset + N(N(N(row * side) + column) * channels) + N(channel))
    quad = texels[U(index)]
    wx, wy = U(x & N(255)), U(y & N(255))
    even, odd = U(quad & _PAIR), U(U(quad >> _SHIFT) & _PAIR)
    pair = U(U(even * U(_BYTE - wx)) + U(odd * wx))
    low, high = U(pair & _LOW), U(pair >> U(16))
    return U(U(U(low * U(_BYTE - wy)) + U(high * wy)) >> _SHIFT)
