"""Textures under trilinear and anisotropic filtering, for all fragments of a row at once.

Bilinear weights have eight bits, as in graphics hardware, so that whole numbers do: two texels
share a 32-bit word, and one multiplication weighs both. Loops have no branches, few arrays (which
the compiled code must find not to overlap) and look nothing up but the texels, so that the compiler
turns them into vector instructions.
"""

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.kernels import inlined, kernel

F, N, U = np.float32, np.int32, np.uint32
_TWO_TEXELS: Final = U(0x00FF00FF)
_FOUR_THIRDS: Final = U(0xAAAAAAAC)  # modulo 2^32, of what three divides
_EXPONENT: Final = N(0x7F800000)
_EXPONENT_OF_ONE: Final = N(127 << 23)
_UP_BITS: Final = N(9)  # where the second and the third number of a weight begin
_SHARE_BITS: Final = N(18)

ONE: Final = 65536
"""What `total` counts as one grey level."""


class Taps(NamedTuple):
    """Room for a tap of each of n fragments, arrays (n,) or, of its finer and its coarser level,
    (2, n)."""

    blend: NDArray[np.int32]
    """The coarser level's share, of 256."""
    side: NDArray[np.int32]
    """Of the finer level, texels."""
    texels: NDArray[np.float32]
    """The same times 256."""
    first: NDArray[np.int32]
    """Where each level begins in the bank."""
    x: NDArray[np.float32]
    """Where the tap lies on the finer level, 1/256 texels, one tile further."""
    y: NDArray[np.float32]
    address: NDArray[np.int32]
    """Of the texels in the bank."""
    weight: NDArray[np.int32]
    """How far to the right and up from the texel it lies, of 256, and the level's share."""
    quad: NDArray[np.uint32]
    """The texels."""


def room_for_taps(n: int) -> Taps:
    """Memory for a tap of each of n fragments."""
    blend, side = np.empty((2, n), dtype=np.int32)
    texels, x, y = np.empty((3, n), dtype=np.float32)
    first, address, weight = np.empty((3, 2, n), dtype=np.int32)
    quad = np.empty((2, n), dtype=np.uint32)
    return Taps(blend, side, texels, first, x, y, address, weight, quad)


@kernel
def sample(bank: Any, fragments: Any, n: int, taps: Any) -> None:
    """Fill in the totals of the first n fragments.

    Args:
        bank: a `TextureBank`.
        fragments: `Fragments`.
        n: how many of them.
        taps: `Taps`, for work.
    """
    most = 1
    for k in range(n):
        most = max(most, int(fragments.taps[k]))
    _choose_levels(fragments, n, bank.channels, taps)
    fragments.total[:, :n] = 0
    for tap in range(most):
        _place(fragments, n, tap, taps)
        for coarser in range(2):
            _locate(fragments.taps[:n], tap, coarser, bank.channels, taps)
        for channel in range(bank.channels):
            _load(bank.texels, channel, taps, n)
            _add(taps, fragments.total[channel, :n])


@kernel
def _choose_levels(fragments: Any, n: int, channels: int, taps: Any) -> None:
    """The two levels between which each fragment's footprint lies."""
    bits, each = fragments.width[:n].view(np.int32), N(channels)
    base, size = fragments.base[:n], fragments.size[:n]
    blend, side, texels = taps.blend[:n], taps.side[:n], taps.texels[:n]
    finer, coarser, scale = taps.first[0, :n], taps.first[1, :n], taps.texels[:n].view(np.int32)
    for k in range(n):
        # A float's exponent is the level, its next eight bits the way to the level after; that of
        # the inverse scale 2^-level is the negative.
        blend[k] = N((bits[k] >> N(15)) & N(255))
        scale[k] = N(N(_EXPONENT_OF_ONE + _EXPONENT_OF_ONE) - N(bits[k] & _EXPONENT))
    for k in range(n):
        whole = F(size[k]) * texels[k]
        side[k], texels[k] = N(whole), whole * F(256)
    for k in range(n):
        # The levels before have size^2 (1 + 1/4 + ...) texels.
        area = N(side[k] * side[k])
        before = N(U(U(N(size[k] * size[k])) - U(area)) * _FOUR_THIRDS)
        finer[k] = N(base[k] + N(before * each))
        coarser[k] = N(base[k] + N(N(before + area) * each))


@kernel
def _place(fragments: Any, n: int, tap: int, taps: Any) -> None:
    """Where each fragment's tap lies."""
    u, v, step_u, step_v = (
        fragments.u[:n],
        fragments.v[:n],
        fragments.step_u[:n],
        fragments.step_v[:n],
    )
    counts, texels, x, y, this = fragments.taps[:n], taps.texels[:n], taps.x[:n], taps.y[:n], F(tap)
    for k in range(n):
        away = this - F(0.5) * (counts[k] - F(1))
        # One tile further, so that conversion to an integer rounds down.
        x[k] = (u[k] + away * step_u[k] + F(1)) * texels[k]
        y[k] = (v[k] + away * step_v[k] + F(1)) * texels[k]


@kernel
def _locate(counts: Any, tap: int, coarser: int, channels: int, taps: Any) -> None:
    """The address and the weights of each fragment's tap on one of its levels."""
    n = counts.size
    x_finer, y_finer, sides, blend = taps.x[:n], taps.y[:n], taps.side[:n], taps.blend[:n]
    first, address, weight = (
        taps.first[coarser, :n],
        taps.address[coarser, :n],
        taps.weight[coarser, :n],
    )
    this, each, halvings, scale = F(tap), N(channels), N(coarser), F(0.5) if coarser else F(1)
    for k in range(n):
        side = N(sides[k] >> halvings)
        last = N(side - N(1))
        x, y = N(x_finer[k] * scale - F(128)), N(y_finer[k] * scale - F(128))
        within = N(N(N(N(y >> N(8)) & last) * side) + N(N(x >> N(8)) & last))
        address[k] = N(first[k] + N(within * each))
        share = blend[k] if coarser else N(N(256) - blend[k])
        share = share if this < counts[k] else N(0)
        right, up = N(x & N(255)), N(N(y & N(255)) << _UP_BITS)
        weight[k] = N(N(right | up) | N(share << _SHARE_BITS))


@kernel
def _load(texels: Any, channel: int, taps: Any, n: int) -> None:
    for level in range(2):
        address, quad = taps.address[level, :n], taps.quad[level, :n]
        for k in range(n):
            quad[k] = texels[U(address[k] + channel)]


@kernel
def _add(taps: Any, total: Any) -> None:
    """Add each fragment's share of what lies between the four texels on either level."""
    n = total.size
    finer, coarser = taps.quad[0, :n], taps.quad[1, :n]
    weight, coarser_weight = taps.weight[0, :n], taps.weight[1, :n]
    for k in range(n):
        found = U(_weighed(finer[k], U(weight[k])) + _weighed(coarser[k], U(coarser_weight[k])))
        total[k] = N(total[k] + N(found))


@inlined
def _weighed(quad: Any, weight: Any) -> Any:
    """A level's share of what lies between its four texels."""
    x, y = U(weight & U(255)), U(U(weight >> U(_UP_BITS)) & U(255))
    left_two, right_two = U(quad & _TWO_TEXELS), U(U(quad >> U(8)) & _TWO_TEXELS)
    pair = U(U(left_two * U(U(256) - x)) + U(right_two * x))
    low, high = U(pair & U(0xFFFF)), U(pair >> U(16))
    between = U(U(U(low * U(U(256) - y)) + U(high * y)) >> U(8))
    return U(between * U(weight >> U(_SHARE_BITS)))
