"""Feed damaged files, meshes and point clouds to the package and count what becomes of them.

python benchmarks/fuzz.py --count 20000 --seed 1
"""

from __future__ import annotations

import argparse
import pickle
import sys
import time
from collections import Counter
from pathlib import Path

from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from fuzz_cases import cloud_cases, file_cases, mesh_cases
from fuzz_worker import Case, Pool

_RUN = 100


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, metavar="N", help="go on after N cases")
    parser.add_argument("--failures", type=Path, metavar="DIR", help="keep the cases that fail here")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run one of them again")
    options = parser.parse_args()
    pool = Pool()
    if options.replay is not None:
        print(pool.run(pickle.loads(options.replay.read_bytes())))
        return 0
    counts: Counter[tuple[str, str]] = Counter()
    failures: list[str] = []
    started = time.perf_counter()

    def judge(case: Case) -> None:
        outcome = pool.run(case)
        kind = case.name.split()[0]
        counts[kind, outcome.split(":")[0]] += 1
        if outcome.startswith("BUG"):
            print(f"\n{case.name}\n{outcome}", flush=True)
            failures.append(outcome)
            if options.failures is not None:
                options.failures.mkdir(parents=True, exist_ok=True)
                (options.failures / f"{len(failures)}.pickle").write_bytes(pickle.dumps(case))

    # Short runs of hypothesis: it tries variations of what it tried before, and should not for long.
    for first in range(options.first, options.count, _RUN):
        campaign = given(st.one_of(file_cases(), file_cases(), mesh_cases(), cloud_cases()))(judge)
        campaign = settings(
            max_examples=min(_RUN, options.count - first),
            database=None,
            deadline=None,
            suppress_health_check=list(HealthCheck),
        )(campaign)
        seed(options.seed * 1_000_003 + first)(campaign)()
        if first % (10 * _RUN) == 0 and first:
            print(f"{first} cases, {time.perf_counter() - started:.0f} s", file=sys.stderr, flush=True)
    pool.close()
    print(f"\n{'cases of':<18}{'relief':>8}{'refused':>9}{'failed':>8}")
    for kind in sorted({kind for kind, _ in counts}):
        row = [counts[kind, outcome] for outcome in ("relief", "refused", "BUG")]
        print(f"{kind:<18}{row[0]:>8}{row[1]:>9}{row[2]:>8}")
    row = [
        sum(n for (_, found), n in counts.items() if found == wanted)
        for wanted in ("relief", "refused", "BUG")
    ]
    print(f"{'all':<18}{row[0]:>8}{row[1]:>9}{row[2]:>8}")
    print(f"{sum(row)} cases, seed {options.seed}, {time.perf_counter() - started:.0f} s")
    return bool(failures)


if __name__ == "__main__":
    raise SystemExit(main())
