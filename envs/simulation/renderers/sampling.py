"""Textures under trilinear and anisotropic filtering, for all fragments of a row at once.

Bilinear weights have eight bits, as in graphics hardware, so that whole numbers do: two texels
share a 32-bit word, and one multiplication weighs both. Loops have no branches and look nothing up
but the texels, so that the compiler turns them into vector instructions.
"""

from typing import Any, Final

import numpy as np

from grouser.kernels import kernel

F, N, U = np.float32, np.int32, np.uint32
_TWO_TEXELS: Final = U(0x00FF00FF)
_FOUR_THIRDS: Final = U(0xAAAAAAAC)  # modulo 2^32, of what three divides

ONE: Final = 65536
"""What `total` counts as one grey level."""


@kernel
def sample(bank: Any, fragments: Any, n: int) -> None:
    """Fill in the totals of the first n fragments.

    Args:
        bank: a `TextureBank`.
        fragments: `Fragments`.
    """
    most = 1
    for k in range(n):
        most = max(most, int(fragments.taps[k]))
    fragments.total[:, :n] = 0
    for tap in range(most):
        for coarser in range(2):
            _locate(fragments, n, tap, coarser, bank.channels)
            for channel in range(bank.channels):
                _load(bank.texels, fragments, n, channel)
                _add(fragments, n, channel)


@kernel
def _locate(fragments: Any, n: int, tap: int, coarser: int, channels: int) -> None:
    """Where each fragment's tap lies on the finer or the coarser of its two levels: the address of
    the texels, their weights, and the level's share."""
    u, v = fragments.u[:n], fragments.v[:n]
    step_u, step_v = fragments.step_u[:n], fragments.step_v[:n]
    taps, bits = fragments.taps[:n], fragments.width[:n].view(np.int32)
    base, size = fragments.base[:n], fragments.size[:n]
    address, right, up, share = (
        fragments.address[:n],
        fragments.right[:n],
        fragments.up[:n],
        fragments.share[:n],
    )
    this, each, fine = F(tap), N(channels), coarser == 0
    for k in range(u.size):
        # A float's exponent is the level, its next eight bits the way to the level after.
        blend = N((bits[k] >> N(15)) & N(255))
        level = N((bits[k] >> N(23)) - N(127) + N(coarser))
        side = N(size[k] >> level)
        last, texels = N(side - N(1)), F(side) * F(256)
        away = this - F(0.5) * (taps[k] - F(1))
        # One tile further, so that conversion to an integer rounds down.
        x = N((u[k] + away * step_u[k] + F(1)) * texels - F(128))
        y = N((v[k] + away * step_v[k] + F(1)) * texels - F(128))
        right[k], up[k] = N(x & N(255)), N(y & N(255))
        # The levels before have size^2 (1 + 1/4 + ...) texels.
        before = N(U(U(N(size[k] * size[k])) - U(N(side * side))) * _FOUR_THIRDS)
        within = N(N(N(y >> N(8)) & last) * side) + N(N(x >> N(8)) & last)
        address[k] = N(base[k] + N(N(before + N(within)) * each))
        portion = N(N(256) - blend) if fine else blend
        share[k] = portion if this < taps[k] else N(0)


@kernel
def _load(texels: Any, fragments: Any, n: int, channel: int) -> None:
    address, quad = fragments.address[:n], fragments.quad[:n]
    for k in range(address.size):
        quad[k] = texels[U(address[k] + channel)]


@kernel
def _add(fragments: Any, n: int, channel: int) -> None:
    """Add the share of what lies between the four texels of each fragment."""
    quad, total = fragments.quad[:n], fragments.total[channel, :n]
    right, up, share = fragments.right[:n], fragments.up[:n], fragments.share[:n]
    for k in range(quad.size):
        x, y = U(right[k]), U(up[k])
        left_two, right_two = U(quad[k] & _TWO_TEXELS), U(U(quad[k] >> U(8)) & _TWO_TEXELS)
        pair = U(U(left_two * U(U(256) - x)) + U(right_two * x))
        low, high = U(pair & U(0xFFFF)), U(pair >> U(16))
        between = U(U(U(low * U(U(256) - y)) + U(high * y)) >> U(8))
        total[k] = N(total[k] + N(U(between * U(share[k]))))
