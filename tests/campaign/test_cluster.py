"""The same campaign on a Dask cluster: the same table, rogues included."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from foreshock.campaign import execute, reopen
from foreshock.registry import Registry
from tests.campaign.test_engine import started, table

pytest.importorskip("distributed")

CLUSTER = """
import subprocess, sys
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        command = [sys.executable, "-c", "from foreshock.cli import main; main()", "campaign"]
        sys.exit(subprocess.run([*command, *sys.argv[1:], "--dask", cluster.scheduler_address]).returncode)
"""


def test_a_cluster_gives_the_same_table_and_survives_rogues(campaign_file: Path, tmp_path: Path) -> None:
    factor = '[[factors]]\nparameter = "behaviour"\nvalues = [0, 3, 4, 5]\n'  # rogue.toml
    text = campaign_file.read_text().replace("replicates = 12", "replicates = 1\ntimeout_s = 2.0")
    campaign_file.write_text(text.replace('[[arms]]\nid = "none"\nkind = "none"\n', "") + factor)
    here = started(campaign_file, tmp_path / "here")
    assert execute(here, 1)
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    words = ["run", str(campaign_file), "--out", str(tmp_path / "there")]
    done = subprocess.run(
        [sys.executable, str(script), *words], capture_output=True, text=True, check=False, timeout=180
    )
    assert done.returncode == 3, done.stdout + done.stderr  # some gave no result
    there, changed = reopen(tmp_path / "there", Registry())
    assert changed == []
    rows = [[(r.key, r.status, r.outcome, r.end_s, r.peak_p) for r in table(c)] for c in (here, there)]
    assert rows[0] == rows[1]
    assert {r.status for r in here.rows()} == {"ok", "nan", "hang", "crash", "source"}


SHUFFLED = """
import random, sys
from pathlib import Path
import msgspec
from distributed import LocalCluster
from foreshock.campaign import begin, execute, load_campaign
from foreshock.campaign.cluster import dask_runner
from foreshock.registry import Registry
if __name__ == "__main__":
    file, folder, workers = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    found = begin(*load_campaign(file), folder, Registry())
    cases = list(found.plan.cases)
    random.Random(workers).shuffle(cases)
    shuffled = msgspec.structs.replace(found, plan=msgspec.structs.replace(found.plan, cases=tuple(cases)))
    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster:
        execute(shuffled, 1, runner=dask_runner(cluster.scheduler_address, shuffled.plan))
"""


@pytest.mark.parametrize("workers", [1, 3])
def test_neither_workers_nor_order_change_the_table(campaign_file: Path, tmp_path: Path, workers: int) -> None:
    campaign_file.write_text(campaign_file.read_text().replace("replicates = 12", "replicates = 3"))
    here = started(campaign_file, tmp_path / "here")
    assert execute(here, 1)
    script = tmp_path / "shuffled.py"
    script.write_text(SHUFFLED)
    words = [str(campaign_file), str(tmp_path / "there"), str(workers)]
    done = subprocess.run(
        [sys.executable, str(script), *words], capture_output=True, text=True, check=False, timeout=180
    )
    assert done.returncode == 0, done.stderr
    there, changed = reopen(tmp_path / "there", Registry())
    assert changed == []
    assert [r.status for r in here.rows()] == ["ok"] * 15
    assert table(there) == table(here)


def test_no_scheduler_is_said(campaign_file: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-c", "from foreshock.cli import main; main()", "campaign"]
    words = ["run", str(campaign_file), "--out", str(tmp_path / "out"), "--dask", "tcp://127.0.0.1:1"]
    done = subprocess.run([*command, *words], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert "no scheduler at 'tcp://127.0.0.1:1'" in done.stderr
