"""Scripts on the command line, in files, and in other processes."""

import json
import subprocess
import sys

import pytest

from script.conftest import HEAD, command


def test_a_script_is_executed_where_it_is_given_and_nowhere_else(folder):
    with open(folder / "duffing.py", "a", encoding="utf-8") as file:
        file.write("\nopen('executed', 'a').write('x')\n")
    mark = folder / "executed"
    _, said = command(folder, "run", "study.yaml", "-o", "out.h5", code=2)
    assert "found 'duffing'; allowed: christoforou_yigit" in said
    assert "or the model of an installed package or of a script that is given (--with its file" in said
    assert not mark.exists()
    command(folder, "run", "study.yaml", "-o", "out.h5", "--with", "duffing.py")
    assert mark.read_text() == "x"
    for words in (
        ["show", "out.h5"],
        ["report", "out.h5", "-o", "r.html"],
        ["run", "study.yaml", "-o", "out.h5", "--resume"],
    ):
        _, said = command(folder, *words, code=2)
        assert "duffing" in said
        assert "--with" in said
    _, said = command(folder, "replay", "out.h5", "--at", "parameters.force=0.3", "-o", "r.h5", code=2)
    assert (
        "found the key 'parameters.force'; allowed: the key of an axis, or a number of the model of an installed"
        in said
    )
    _, said = command(folder, "plot", "out.h5", "-o", "r.png", code=2)
    assert "made with the model duffing of the script duffing.py, which is executed only where it is given" in said
    assert "--with duffing.py" in said
    assert mark.read_text() == "x"
    _, said = command(folder, "replay", "--with=duffing.py", "out.h5", "--at", "parameters.force=0.3", "-o", "r.h5")
    assert "bit for bit" in said
    shown, _ = command(folder, "--with", "duffing.py", "show", "out.h5", "--json")
    assert json.loads(shown)


def test_no_point_is_told_of_a_model_without_depth_weight_and_speed(folder):
    (folder / "one.yaml").write_text("model: duffing\nsimulation: {transient: 1 s, observe: 2 s}\n")
    _, said = command(folder, "simulate", "one.yaml", "-o", "trace.h5", "--with", "duffing.py")
    assert "trace.h5: " in said
    assert "Point" not in said


def test_the_next_command_has_the_script(folder):
    study = "model: duffing\nuncertain: {parameters.force: {uniform: [0.1, 0.5]}}\n"
    (folder / "u.yaml").write_text(f"{study}simulation: {{transient: 5 s, observe: 20 s}}\n")
    (folder / "data.csv").write_text("parameters.omega,v_max\n1.2,0.9\n1.4,1.0\n")
    words = ["fit", "u.yaml", "--data", "data.csv", "-o", "a.yaml", "--error", "v_max=5%", "--batch", "16"]
    _, said = command(folder, *words, "--rounds", "2", "-q", "--with", "duffing.py")
    assert "a.yaml: written. Next: nsdrill run a.yaml -o out.h5 --with duffing.py" in said
    _, said = command(folder, "--with", "duffing.py", "new", "--model", "duffing", "-o", "n.yaml")
    assert "Next: nsdrill check n.yaml --with duffing.py; nsdrill run n.yaml -o out.h5 --with duffing.py" in said


def test_a_file_says_by_which_script_it_was_made_and_is_refused_with_another(folder):
    import h5py

    command(folder, "run", "study.yaml", "-o", "out.h5", "--with", "duffing.py")
    with h5py.File(folder / "out.h5") as file:
        assert file.attrs["model_script"] == "duffing.py"
        assert len(file.attrs["model_digest"]) == 16
    text = (folder / "duffing.py").read_text()
    (folder / "duffing.py").write_text(f"# a comment\n{text}")
    _, said = command(folder, "show", "out.h5", "--with", "duffing.py")
    assert "Warning" not in said
    (folder / "duffing.py").write_text(text.replace("+ x -", "+ 1.5 * x -"))
    _, said = command(folder, "show", "out.h5", "--with", "duffing.py", code=2)
    assert said.count("CHANGED SINCE THE RUNS: made with the model duffing of the script duffing.py") == 1
    at = ["--at", "parameters.force=0.3", "-o", "r.h5"]
    _, said = command(folder, "replay", "out.h5", *at, "--with", "duffing.py", code=2)
    assert "CHANGED SINCE THE RUNS" in said
    # the remedy: the study of the file is run again
    again, _ = command(folder, "show", "out.h5", "--study", "--with", "duffing.py")
    (folder / "again.yaml").write_text(again)
    command(folder, "run", "again.yaml", "-o", "again.h5", "--with", "duffing.py")
    command(folder, "show", "again.h5", "--with", "duffing.py")


FAULTS = {
    "absent.py": (None, "--with absent.py: found no such file"),
    "syntax.py": ("def f(:\n", "--with syntax.py, line 1: SyntaxError"),
    "raises.py": ("x = 1\n\n1 / 0\n", "--with raises.py, line 3: ZeroDivisionError: division by zero"),
    "leaves.py": ("import sys\nsys.exit(3)\n", "--with leaves.py, line 2: SystemExit: 3"),
    "wave.py": ("x = 1\n", "--with wave.py: found the name wave.py; allowed: a name of letters"),
    "notes.txt": ("x = 1\n", "--with notes.txt: found the name notes.txt"),
    "faulty.py": (
        "import nsdrill\n\n\n@nsdrill.model\ndef bad(x, v=0.0):\n    return v, -x\n",
        "faulty.py, line 4: bad: found x without a default",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_script_is_told_with_its_line(tmp_path, name):
    text, words = FAULTS[name]
    if text is not None:
        (tmp_path / name).write_text(text, encoding="utf-8")
    _, said = command(tmp_path, "show", "x.h5", "--with", name, code=2)
    assert words in said


def test_with_needs_a_file(tmp_path):
    _, said = command(tmp_path, "show", "x.h5", "--with", code=2)
    assert "'--with' requires an argument" in said


def test_what_a_script_prints_is_no_data(folder):
    with open(folder / "duffing.py", "a", encoding="utf-8") as file:
        file.write("\nprint('hello')\n")
    told, said = command(folder, "check", "study.yaml", "--json", "--with", "duffing.py")
    assert json.loads(told)["points"] == 2
    assert "hello" in said


def test_start_up_reads_no_script(tmp_path):
    """`nsdrill --version` imports none of the rooms of models."""
    code = (
        "import sys\nsys.argv = ['nsdrill', '--version']\nfrom nsdrill.cli import main\n"
        "try:\n    main.main()\nexcept SystemExit:\n    pass\n"
        "print([n for n in sys.modules if n.startswith(('nsdrill.script', 'nsdrill.models', 'numpy'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.splitlines()[-1] == "[]"


def test_other_processes_execute_the_script_that_made_the_model_here(folder, monkeypatch):
    """A process of its own, as a worker of a cluster is: with the same bits."""
    script = folder / "elsewhere.py"
    script.write_text(
        "from concurrent.futures import ProcessPoolExecutor\nfrom multiprocessing import get_context\n\n"
        "import numpy as np\nfrom duffing import duffing\nfrom nsdrill.app.running.run import run_in_memory\n\n"
        "if __name__ == '__main__':\n"
        "    study = duffing.study(force=[0.1, 0.3], transient=10, observe=10)\n"
        "    with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as pool:\n"
        "        there = run_in_memory(study, executor=pool, workers=1)\n"
        "    here = run_in_memory(study, workers=1)\n"
        "    print(np.array_equal(there.variables['final_state'], here.variables['final_state']))\n",
        encoding="utf-8",
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, cwd=folder, timeout=300)
    assert done.stdout.splitlines()[-1:] == ["True"], done.stderr


def test_a_model_of_a_notebook_is_not_sent_to_other_processes():
    """A notebook's cell is no file that another process could read."""
    import linecache
    from concurrent.futures import ProcessPoolExecutor

    from nsdrill.app.running.run import run_in_memory
    from nsdrill.errors import InputError

    text = "import nsdrill\n\n\n@nsdrill.model\ndef cell_of_a_notebook(x=0.1, *, k=1.0):\n    return (-k * x,)\n"
    linecache.cache["<ipython-input-3>"] = (len(text), None, text.splitlines(True), "<ipython-input-3>")
    space = {"__name__": "__main__"}
    exec(compile(text, "<ipython-input-3>", "exec"), space)
    study = space["cell_of_a_notebook"].study(transient=1, observe=1, k=[1.0, 2.0])
    assert (run_in_memory(study).variables["status"] == 1).all()
    with (
        ProcessPoolExecutor(1) as pool,
        pytest.raises(InputError, match="it is of a notebook, which they cannot read; allowed: threads"),
    ):
        run_in_memory(study, executor=pool)


@pytest.mark.parametrize(
    ("numbers", "axis"),
    [
        ("load=number(2.0, 'N', low=1.5)", "load: {from: 1.5 N, to: 3 N,"),
        ("least=0.5, most=0.6, rate=4.0", "rate: {from: 2, to: 6,"),
    ],
)
def test_a_template_of_its_model_is_valid(tmp_path, numbers, axis):
    orders = "(orders=('least <= most',))" if "least" in numbers else ""
    text = f"@nsdrill.model{orders}\ndef own(x=1.0, *, {numbers}):\n    return (-x,)\n"
    (tmp_path / "own.py").write_text(HEAD + text)
    command(tmp_path, "new", "--model", "own", "--with", "own.py", "-o", "own.yaml")
    assert f"parameters.{axis}" in (tmp_path / "own.yaml").read_text()
    assert "own.yaml: valid" in command(tmp_path, "check", "own.yaml", "--with", "own.py")[0]
