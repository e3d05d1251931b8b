"""Every experiment takes `--scheduler`, and nothing else does."""

import inspect

import pytest
import typer

from hil.cli import app, codecs, main, paper, verdicts

COMMANDS = [
    (f"{prefix}{name}", command)
    for prefix, group in (("", app), ("paper ", paper), ("verdicts ", verdicts), ("codecs ", codecs))
    for name, command in typer.main.get_command(group).commands.items()
]


@pytest.mark.parametrize(("name", "command"), COMMANDS, ids=[name for name, _ in COMMANDS])
def test_what_computes_cells_takes_a_scheduler(name, command):
    options = {option for parameter in command.params for option in parameter.opts}
    assert ("--scheduler" in options) == ("--cells" in options)


def test_workers_do_not_go_with_a_cluster(capsys):
    with pytest.raises(SystemExit) as left:
        main(["messages", "--workers", "2", "--scheduler", "tcp://127.0.0.1:9"])
    assert left.value.code == 2
    assert "the cluster has its own" in capsys.readouterr().err


def test_a_scheduler_that_is_not_there_gets_one_sentence(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("mtm_audit.batch.cluster._CONNECT_S", 0.5)
    with pytest.raises(SystemExit) as left:
        main(["messages", "-n", "1", "--scheduler", "tcp://127.0.0.1:9"])
    assert left.value.code == 1
    assert "mtm-hil: no Dask scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err


def test_the_option_stands_behind_those_of_the_command():
    callback = next(command.callback for command in app.registered_commands if command.callback.__name__ == "messages")
    assert list(inspect.signature(callback).parameters)[-1] == "scheduler"
