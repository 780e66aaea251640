"""Study: plan it, run it, ask it."""

from __future__ import annotations

import shlex
import time
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self
from weakref import finalize

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.questions.declaration import Declaration
from swarm_logistics_env.study.questions.plan import Plan, make_plan, refuse_changed_policies
from swarm_logistics_env.study.questions.presets import load_preset
from swarm_logistics_env.study.questions.specification import Specification, read_study_file
from swarm_logistics_env.study.runs.engines import Engine, Shard, Tally, engine_named, play
from swarm_logistics_env.study.runs.notes import StoredStudy, note
from swarm_logistics_env.study.runs.recorded import imported_plan
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs
from swarm_logistics_env.study.tasks.task import Outcomes, Run, Task, refuse_untrusted
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from swarm_logistics_env.study.verdicts.until_clear import Judged, LatestLook, latest_look

if TYPE_CHECKING:
    import pandas as pd

    from swarm_logistics_env.study.report.findings import Findings


def _changes(store: Runs, plan: Plan) -> tuple[str, ...]:
    """Return why runs that were stored do not count any more; discard damaged ones."""
    stored = StoredStudy.of(store)
    damage = store.discard_damaged()
    changed = tuple(stored.changes(plan)) if stored and len(store) else ()
    return (*changed, damage) if damage else changed


class Study:
    """A study of how a swarm copes: conditions, paired seeds, indicators with their verdicts.

    Args:
        out: directory of the store and the report; None keeps the results in memory.
        fields: the fields of `Specification`, e.g. `task="warehouse"`, `policies=["swarm-dt"]`,
            `seeds=20`, `faults=[{"modes": ["FM1"], "robots": [1, 2]}]`.

    Raises:
        StudyError: a field is unknown, or its value is not allowed.

    Example:
        >>> study = Study(
        ...     seeds=2, scenario={"duration": 5.0}, faults=[{"modes": ["FM1"], "robots": [1]}]
        ... )
        >>> len(study.plan().cases)
        3
    """

    def __init__(self, *, out: str | Path | None = None, **fields: Any) -> None:
        self._specification = Specification(**fields)
        self.out = None if out is None else Path(out)
        self._plan: Plan | None = None
        # By case and seed, what each outcome raised when it was last looked at, and that look.
        self._look: tuple[dict[tuple[str, int], str | None], LatestLook] | None = None
        self._judged: Judged = {}
        self._memory: Runs | None = None

    @classmethod
    def preset(cls, name: str, *, out: str | Path | None = None, **fields: Any) -> Self:
        """Return the preset study of that name, with some fields changed.

        Raises:
            StudyError: there is no such preset, or a field cannot be.
        """
        return cls(out=out, **{**dict(load_preset(name)), **fields})

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        *,
        out: str | Path | None = None,
        trust_code: bool = False,
        **fields: Any,
    ) -> Self:
        """Return the study that a TOML file describes (`read_study_file`), some fields changed.

        Args:
            trust_code: whether the file may name a task or policies that are code, which runs it.

        Raises:
            StudyError: the file cannot be read, or a field of it is unknown or cannot be.
        """
        specification = read_study_file(Path(path), trust_code=trust_code)
        return cls(out=out, **{**dict(specification), **fields})

    @classmethod
    def stored(cls, out: str | Path, *, task: Task | None = None, trust_code: bool = False) -> Self:
        """Return a study that was run before, as it was run: code version and policies included.

        Its policies need not be importable any more.

        Args:
            task: the task that it names; None: it is found by that name.
            trust_code: whether it may be found by importing it, which runs its module.

        Raises:
            StudyError: there is none, its store does not say how it was planned, or its task is not
                found.
        """
        out = Path(out)
        stored = StoredStudy.existing(out)
        fields = {**stored.specification.model_dump(), "out": out}
        if task is None:
            refuse_untrusted(out, stored.specification.task, trust_code=trust_code)
        else:
            fields["task"] = task
        study = cls(**fields)
        specification = study.specification
        if stored.imported is not None:
            study._plan = imported_plan(specification, stored.imported)
        else:
            study._plan = make_plan(specification, code=stored.code, identities=stored.identities)
        return study

    @property
    def specification(self) -> Specification:
        """What is asked. Another one makes another plan.

        Raises:
            StudyError: another one is set, and the runs were recorded elsewhere.
        """
        return self._specification

    @specification.setter
    def specification(self, changed: Specification) -> None:
        if self._plan is not None and self._plan.origin is not None:
            raise StudyError("specification: a study that was imported asks what its trials vary")
        self._specification = changed
        self._plan = None
        self._look = None
        self._judged = {}

    def plan(self) -> Plan:
        """Return the conditions and comparisons, shared conditions once; nothing is run."""
        if self._plan is None:
            self._plan = make_plan(self.specification)
        return self._plan

    def run(
        self,
        engine: Engine | str | None = None,
        *,
        processes: int | None = None,
        address: str | None = None,
        shard: Shard | None = None,
        minutes: float | None = None,
        run_limit: float | None = None,
        after_look: Callable[[StudyResults], None] | None = None,
    ) -> Tally:
        """Play the runs that are missing, and those that failed before; each is kept at once.

        It gives up where nothing works: see `play`.

        Args:
            engine: the engine that plays them: "local" (this process), "process", "ray", or an
                engine of your own; None means this process, or `processes` of them.
            processes: the number of worker processes.
            address: the address of the Ray cluster; None starts one on this machine.
            shard: the part to play, if other machines play the others; None means all.
            minutes: begin no further run after this time; the same call goes on. None: no end.
            run_limit: wall-clock time after which a worker process fails a run [s]; None: an hour.
            after_look: called with the results so far when all runs of a look are played, and
                before, when P of the condition that most comparisons share has the seeds of the
                first look; in a study that runs until it is clear.

        Raises:
            StudyError: the store or the engine cannot be used, or the store is another study's.
        """
        plan = self.plan()
        self._check_playable(shard)
        if engine is None or isinstance(engine, str):
            usual = "process" if (processes or 1) > 1 else "local"
            engine = engine_named(engine or usual, processes, address, run_limit)
        all_runs = self._runs(shard)
        errors: list[str | None] = []
        start = time.monotonic()
        left = 0
        end = None if minutes is None else start + 60.0 * minutes
        with self._store() as store:
            changed = _changes(store, plan)
            note(store, plan, self._declared(store))
            n_before = len({run.key for run in all_runs} & store.succeeded())
            tried: set[str] = set()

            def next_runs() -> list[Run]:
                # A run that failed in this call is not tried again.
                missing = self._missing(all_runs, store, tried, in_stages=True)
                tried.update(run.key for run in missing)
                if after_look:
                    after_look(self._results(store))
                return missing

            missing = self._missing(all_runs, store, tried, in_stages=True)
            refuse_changed_policies(plan, missing)
            if missing:
                tried.update(run.key for run in missing)
                errors, left = play(
                    missing,
                    engine,
                    store,
                    self.specification.name,
                    end,
                    has_worked=bool(n_before),
                    more=next_runs if self.specification.until_clear else None,
                    n_most=self._n_most if self.specification.until_clear else None,
                )
        failed = [error for error in errors if error is not None]
        is_late = end is not None and time.monotonic() > end
        return Tally(
            len(errors),
            len(failed),
            n_before,
            time.monotonic() - start,
            next(iter(failed), None),
            left,
            gave_up=bool(left) and not (is_late or n_before or None in errors),
            changes=changed,
        )

    def _check_playable(self, shard: Shard | None) -> None:
        plan = self.plan()
        code = self.specification.played.code()
        if plan.code != code:
            raise StudyError(
                f"this study was played under code version {plan.code}, this is "
                f"{code}: plan it anew, and all of it runs again"
            )
        if plan.origin is not None:
            raise StudyError(f"the study in {self.out} was imported: run into a new directory")
        if self.specification.until_clear and shard:
            raise StudyError(
                "shard: should not be with until_clear, where all runs decide the next"
            )

    def _runs(self, shard: Shard | None) -> Sequence[Run]:
        return shard.of(self.plan().runs) if shard else self.plan().runs

    def _missing(
        self, runs: Sequence[Run], store: Runs, tried: Collection[str], *, in_stages: bool = False
    ) -> list[Run]:
        """Return what is to be played next, but for what was tried already.

        Args:
            in_stages: whether what the first look needs is what most comparisons share, then the
                rest, so that P stands early.
        """
        done = store.succeeded() | set(tried)
        if not self.specification.until_clear:
            return [run for run in runs if run.key not in done]
        outcomes = store.outcomes(run for run in runs if run.key in done)
        look = self._latest_look(outcomes)
        return list((in_stages and look.shared_runs) or look.next_runs)

    def _latest_look(self, outcomes: Outcomes) -> LatestLook:
        """Return the latest look at these outcomes; computed anew if runs were played since."""
        errors = {key: outcome.error for key, outcome in outcomes.items()}
        if self._look is None or self._look[0] != errors:
            self._look = errors, latest_look(self.plan(), outcomes, self._judged)
        return self._look[1]

    def _n_most(self) -> int:
        """Return how many runs are left at most after the latest look at the outcomes."""
        return 0 if self._look is None else self._look[1].n_most

    def _results(self, store: Runs) -> StudyResults:
        """Return what the stored runs say."""
        plan = self.plan()
        outcomes = store.outcomes(plan.runs)
        look = self._latest_look(outcomes) if self.specification.until_clear else None
        return judge(plan, outcomes, self._declared(store), look)

    def finished(self, shard: Shard | None = None) -> tuple[int, int]:
        """Return how many runs have succeeded, and of how many.

        A study that runs until it is clear counts those that its next look needs, because what the
        later ones need is not known yet.

        Args:
            shard: of which part; None: of all.
        """
        runs = self._runs(shard)
        try:
            with self._store(existing=True) as store:
                done = len({run.key for run in runs} & store.succeeded())
                return done, done + len(self._missing(runs, store, ()))
        except StudyError:  # nothing has been run
            return 0, len(runs)

    def is_exploratory(self) -> bool:
        """Return whether verdicts over the asked seeds would be exploratory.

        Raises:
            StudyError: the store cannot be read, or is another study's.
        """
        if self.out is None or not (self.out / FILE_NAME).is_file():
            return False  # nothing has been run: what is asked now will be declared
        with self._store(existing=True) as store:
            return not self._declared(store).covers(self.plan())

    def __repr__(self) -> str:
        where = "in memory" if self.out is None else f"in {self.out}"
        return f"Study({self.specification.name!r}, {where})"

    def _repr_html_(self) -> str:
        policies = ", ".join(policy.title for policy in self.specification.policies)
        done, of_all = self.finished()
        words = f"{self.plan()}; {policies}; {done} of {of_all} runs done"
        return f"<b>{escape(repr(self))}</b><br>{escape(words)}"

    def findings(self) -> Findings:
        """Return every cell and every verdict, from the runs that are there.

        Raises:
            StudyError: nothing has been run, or the store is another study's.
        """
        from swarm_logistics_env.study.report.findings import Findings

        with self._store(existing=True) as store:
            return replace(Findings.of(self._results(store)), damage=store.damage())

    def results(self) -> pd.DataFrame:
        """Return one row per finished run: condition, seed, P, delivery times [s], error.

        Warns:
            UserWarning: stored runs are damaged, and left out.
        """
        with self._store(existing=True) as store:
            if damage := store.damage():
                warnings.warn(damage, stacklevel=2)
            return store.frame(run.key for run in self.plan().runs)

    def performance(self) -> pd.DataFrame:
        """Return one row per policy and condition: mean P and its intervals (`CELL_COLUMNS`)."""
        return self.findings().cell_table

    def indicators(self) -> pd.DataFrame:
        """Return one row per comparison: indicator, interval, verdicts (`VERDICT_COLUMNS`)."""
        return self.findings().verdict_table

    def report(self, path: str | Path | None = None) -> tuple[Path, ...]:
        """Write the report into a directory, see `report/write.py`; return the paths of its files.

        Args:
            path: the directory; None: the study's own.

        Raises:
            StudyError: nothing has been run, there is no directory, or it cannot be written.
        """
        from swarm_logistics_env.study.report.write import write_report

        directory = self.out if path is None else Path(path)
        if directory is None:
            raise StudyError("report needs a path: the study is kept in memory")
        return write_report(self.findings(), directory)

    def _declared(self, store: Runs) -> Declaration:
        """Return what was declared before the first run; raise StudyError if another study was."""
        noted = StoredStudy.of(store)
        if noted is None:
            return Declaration.model_validate(self.specification)
        if differing := noted.specification.differing(self.specification):
            raise StudyError(
                f"{self.out} holds the study {noted.specification.name!r} with other "
                f"{', '.join(differing)}: this one should be kept in another directory, --out "
                f"{shlex.quote(f'{self.out}-2')}"
            )
        return noted.declared

    @contextmanager
    def _store(self, *, existing: bool = False) -> Iterator[Runs]:
        if self.out is None:
            if self._memory is None:
                if existing:
                    raise StudyError("nothing has been run: call run() first")
                self._memory = Runs(None)
                finalize(self, self._memory.close)
            yield self._memory
            return
        with Runs.existing(self.out) if existing else Runs(self.out / FILE_NAME) as opened:
            yield opened
