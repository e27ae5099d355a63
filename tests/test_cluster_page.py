"""The page on studies has what the benchmark of a cluster measured, and nothing typed in."""

import importlib.util
import json
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]


def test_the_plan_for_many_workers_is_computed_from_the_figures_that_the_benchmark_keeps():
    path = REPOSITORY / "docs" / "hooks" / "cluster.py"
    spec = importlib.util.spec_from_file_location("cluster", path)
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    runs = json.loads(hook.FIGURES.read_text(encoding="utf-8"))
    assert runs[-1]["same_as_one_process"] is True
    page = REPOSITORY / "docs" / "how-to" / "study-before-you-travel.md"
    filled = hook.on_page_markdown(page.read_text(encoding="utf-8"))
    assert "<!-- cluster" not in filled
    assert f"| {1e3 * hook.largest(runs)['worker_s_a_campaign']:.0f} ms |" in filled
    slower = {
        **hook.largest(runs),
        "campaigns": 10**5,
        "samples": 20_000,
        "scheduler_s_a_task": 2.0,
        "command_s_a_task": 0.5,
        "same_as_one_process": False,
    }
    said = hook.plan([slower, *runs])
    seconds = 16 * 5 * slower["worker_s_a_campaign"]
    assert f"carries at least {0.8 * seconds / 2.0:.0f} workers" in said
    assert "one process are not equal" in said
