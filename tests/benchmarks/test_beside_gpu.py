"""The benchmark of a GPU, with this processor in place of one."""

import json
import sys

import pytest


def test_what_is_measured_is_printed_and_written(tmp_path, monkeypatch, capsys):
    from benchmarks import gpu

    several = {"map": gpu.study(2, 3, 0.1, 0.1)}
    monkeypatch.setattr(gpu, "cases", lambda quick: several)
    monkeypatch.setattr(sys, "argv", ["gpu", "--quick", "--only", "bits,chains", "--out", str(tmp_path / "gpu")])
    monkeypatch.setenv("NSDRILL_GPU", "host")
    gpu.main()
    found = json.loads((tmp_path / "gpu.json").read_text())
    assert "failed" not in found
    assert [(row["case"], row["differing"]) for row in found["bits"]] == [
        ("map", {}),
        ("runs that grow without bound", {}),
    ]
    assert all(row["equal"] == row["numbers"] > 0 for row in found["bits"])
    assert found["bits"][1]["status"]["2"] > 0, "some run diverges"
    assert [row["chains"] for row in found["chains"]] == [1, 4, 16] * 2
    assert all(row["rate"] > 0 for row in found["chains"])
    assert "numbers with the same bits" in capsys.readouterr().out


def test_without_a_gpu_one_sentence_says_so(monkeypatch):
    from benchmarks import gpu
    from nsdrill.errors import DeviceError
    from nsdrill.sweep.gpu import Gpu

    def found():
        raise DeviceError("the driver is not installed")

    monkeypatch.setattr(Gpu, "found", found)
    monkeypatch.setattr(sys, "argv", ["gpu"])
    with pytest.raises(SystemExit, match=r"^No GPU to measure\. the driver is not installed$"):
        gpu.main()
