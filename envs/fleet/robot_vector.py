"""A vector of environments in a few processes: as Gymnasium's AsyncVectorEnv, at less cost a step.

What every environment shows at a step has a fixed place in shared memory, so that a command and an
answer a process are all that goes through pipes. The process that asks steps a crew of its own
while the others step theirs: it would have to wait for them anyway, and so it neither sleeps nor
wakes. There are no more processes than processors.
"""

import multiprocessing
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import AlreadyPendingCallError, ClosedEnvironmentError, NoAsyncCallError
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from grouser.envs.fleet.crew import Info, Maker
from grouser.envs.fleet.page import Field, Page, PageFormat
from grouser.envs.fleet.team import Team

Observation = dict[str, Any]
Flags = NDArray[np.bool_]
Step = tuple[Observation, NDArray[np.float64], Flags, Flags, dict[str, Any]]


class RobotVectorEnv(VectorEnv[Observation, Any, Any]):
    """Environments of one kind, whose observations are arrays by name.

    All methods of Gymnasium's AsyncVectorEnv are there and do what they do in it, but for this: an
    error of an environment ends nothing, and carries the traceback of its process as its cause; a
    wait that timed out may be done again.

    Args:
        makers: of the environments; they are called in the processes that step them, and the first
            once more, to see its spaces.
        info: fields of what an environment's info has at every step; other infos cost more.
        context: how processes start, as multiprocessing has it: "fork", "spawn" or "forkserver".
        copy: return observations in memory of their own; else the next step writes over them.
        autoreset_mode: when an environment whose episode ended is reset.
        caller_steps: whether the calling process steps a share of the environments itself, in
            `step_wait`. Where it is the only process, it steps all of them all the same.
    """

    def __init__(
        self,
        makers: Sequence[Maker],
        *,
        info: Mapping[str, Field],
        context: str | None = None,
        copy: bool = True,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        caller_steps: bool = True,
    ) -> None:
        self.num_envs, self._copy = len(makers), copy
        mode = AutoresetMode(autoreset_mode)
        parts = self._look_at(makers[0], mode).spaces
        page_format = PageFormat(
            {key: (space.dtype, space.shape or ()) for key, space in parts.items()},
            info,
            len(makers),
        )
        self._team = Team(
            makers, page_format, context=context, mode=mode, caller_steps=caller_steps
        )
        self._pending: str | None = None

    @property
    def processes(self) -> list[Any]:
        """Those that were started, beside the calling one."""
        return self._team.processes

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Of every environment."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Of every environment."""
        return self.get_attr("np_random_seed")

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Reset all environments, or those that options["reset_mask"] (num_envs,) names.

        Args:
            seed: the first one's, of which the others follow, or one for each.
        """
        self.reset_async(seed=seed, options=options)
        return self.reset_wait()

    def reset_async(
        self,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> None:
        """Begin it.

        Raises:
            ValueError, TypeError: there is not a seed for each, or the mask is none.
            AlreadyPendingCallError: something else was begun.
            ClosedEnvironmentError: `close` was called.
        """
        seeds = self._seeds(seed)
        others, mask = _without_mask(options, self.num_envs)
        self._begin("reset", "reset", lambda envs: (seeds[envs], others, mask[envs]))

    def reset_wait(self, timeout: float | None = None) -> tuple[Observation, dict[str, Any]]:
        """End it.

        Raises:
            NoAsyncCallError: it was not begun.
            multiprocessing.TimeoutError: it took more than so many seconds.
        """
        page, infos = self._shown(self._end("reset", timeout))
        return page.observation, infos

    def step(self, actions: Any) -> Step:
        """Step every environment with its action."""
        self.step_async(actions)
        return self.step_wait()

    def step_async(self, actions: Any) -> None:
        """Begin it.

        Raises:
            ValueError: there is not an action for each.
            AlreadyPendingCallError: something else was begun.
            ClosedEnvironmentError: `close` was called.
        """
        if len(actions) != self.num_envs:
            raise ValueError(
                f"a vector of {self.num_envs} takes as many actions, got {len(actions)}"
            )
        self._begin("step", "step", lambda envs: (actions[envs],))

    def step_wait(self, timeout: float | None = None) -> Step:
        """End it.

        Raises:
            NoAsyncCallError: it was not begun.
            multiprocessing.TimeoutError: it took more than so many seconds.
        """
        page, infos = self._shown(self._end("step", timeout))
        return page.observation, page.reward, page.terminated, page.truncated, infos

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What every environment has under a name, or gives when that is called."""
        self.call_async(name, *args, **kwargs)
        return self.call_wait()

    def call_async(self, name: str, /, *args: Any, **kwargs: Any) -> None:
        """Begin it.

        Raises:
            ValueError: a name of which the vector has a method of its own.
            AlreadyPendingCallError: something else was begun.
            ClosedEnvironmentError: `close` was called.
        """
        if name in ("reset", "step", "close"):
            raise ValueError(f"call the vector's own {name}() instead of call({name!r})")
        self._begin("call", "call", lambda envs: (name, args, kwargs))

    def call_wait(self, timeout: float | None = None) -> tuple[Any, ...]:
        """End it.

        Raises:
            NoAsyncCallError: it was not begun.
            multiprocessing.TimeoutError: it took more than so many seconds.
        """
        return tuple(self._end("call", timeout))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """What every environment has under a name."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Give every environment a value of an attribute: one for all, or a list of one for each.

        Raises:
            ValueError: the list has another length.
        """
        each = values if isinstance(values, (list, tuple)) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise ValueError(
                f"a vector of {self.num_envs} takes as many values of {name}, got {len(each)}"
            )
        self._begin("set_attr", "set_attr", lambda envs: (name, each[envs]))
        self._end("set_attr", None)

    def render(self) -> tuple[Any, ...]:
        """Every environment's picture."""
        return self.call("render")

    def close_extras(self, timeout: float | None = None, terminate: bool = False) -> None:
        """Close all environments and end their processes, at once where `terminate` says so or what
        was begun takes longer than a timeout [s]."""
        if self._pending is not None and not terminate:
            try:
                self._team.end(timeout)
            except multiprocessing.TimeoutError:
                terminate = True
            except Exception:  # of what nobody waits for any more
                pass
        if terminate:
            self._team.terminate()
        else:
            self._team.close()

    def __del__(self) -> None:
        if not self.closed and "_team" in vars(self):
            self.close(terminate=True)

    def _look_at(self, maker: Maker, mode: AutoresetMode) -> spaces.Dict:
        """Take over what an environment says of itself; the space of its observations."""
        env = maker()
        self.metadata = {**env.metadata, "autoreset_mode": mode}
        self.render_mode = env.render_mode
        assert isinstance(env.observation_space, spaces.Dict)
        self.single_observation_space = env.observation_space
        self.single_action_space = env.action_space
        self.observation_space = batch_space(env.observation_space, self.num_envs)
        self.action_space = batch_space(env.action_space, self.num_envs)
        env.close()
        return env.observation_space

    def _begin(self, what: str, method: str, arguments: Any) -> None:
        if self.closed:
            raise ClosedEnvironmentError("the vector was closed; make a new one")
        if self._pending is not None:
            raise AlreadyPendingCallError(
                f"{what} cannot begin before {self._pending}_wait() has ended {self._pending}",
                self._pending,
            )
        self._team.begin(method, arguments)
        self._pending = what

    def _end(self, what: str, timeout: float | None) -> list[Any]:
        if self.closed:
            raise ClosedEnvironmentError("the vector was closed; make a new one")
        if self._pending != what:
            raise NoAsyncCallError(f"{what}_wait() comes after {what}_async()", what)
        try:
            answers = self._team.end(timeout)
        except multiprocessing.TimeoutError:
            raise
        except Exception:
            self._pending = None
            raise
        self._pending = None
        return answers

    def _shown(self, infos: Sequence[Info]) -> tuple[Page, dict[str, Any]]:
        """What is on the page, and all infos."""
        page = self._team.page.copied(observations=self._copy)
        if all(info is None for info in infos):
            return page, page.infos()
        batched: dict[str, Any] = {}
        for index, info in enumerate(infos):
            own = page.info_of(index) if info is None else info
            batched = self._add_info(batched, own, index)
        return page, batched

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (int, np.integer)):
            return [int(seed) + index for index in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"a vector of {self.num_envs} takes as many seeds, got {len(seed)}")
        return list(seed)


def _without_mask(
    options: dict[str, Any] | None, num_envs: int
) -> tuple[dict[str, Any] | None, list[bool]]:
    """The options for every environment, and which of them to reset.

    Raises:
        TypeError: the mask is no array of truth values.
        ValueError: it is not one for each, or names none.
    """
    if options is None or "reset_mask" not in options:
        return options, [True] * num_envs
    others = {name: value for name, value in options.items() if name != "reset_mask"}
    mask = options["reset_mask"]
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"options['reset_mask'] must be a NumPy array of bool, got {mask!r}")
    if mask.shape != (num_envs,) or not mask.any():
        raise ValueError(
            f"options['reset_mask'] must name some of {num_envs} environments, got {mask!r}"
        )
    return others, mask.tolist()
