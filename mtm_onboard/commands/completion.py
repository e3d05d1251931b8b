"""What completes the program's commands and options in a shell, made from its own command line."""

import argparse

SHELLS = ("bash", "zsh")
# Zsh runs bash's completions once it is told to.
_SCRIPT = """if [ -n "$ZSH_VERSION" ]; then autoload -U +X bashcompinit && bashcompinit; fi
_{name}() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" words=""
    if [ "$COMP_CWORD" -eq 1 ]; then
        words="{commands}"
    else
        case "${{COMP_WORDS[1]}}" in
{cases}
        esac
        case "$word" in -*) ;; *) words="" ;; esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _{name} {program}
"""


def completion_script(parser: argparse.ArgumentParser) -> str:
    """A script for bash, and for zsh, to be sourced: commands, then options; files everywhere else."""
    subparsers = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    cases = [f'            {word}) words="{_options(sub)}" ;;' for word, sub in subparsers.choices.items()]
    words = " ".join([*subparsers.choices, _options(parser)])
    name = parser.prog.replace("-", "_")
    return _SCRIPT.format(name=name, program=parser.prog, commands=words, cases="\n".join(cases))


def _options(parser: argparse.ArgumentParser) -> str:
    return " ".join(option for action in parser._actions for option in action.option_strings)
