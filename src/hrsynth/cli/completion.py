"""Completion for bash, zsh and fish: scripts that call ``hrsynth completion words``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ..options import NEEDED, Option
from .colour import print_text
from .commands import Group, add_command
from .options import list_shipped_names

EXAMPLE = "example:"
WORDS = "words"
"""Argument of the scripts in place of a shell's name, followed by the words typed so far."""
SCRIPTS = {
    "bash": """_hrsynth() {
    local typed last IFS=$' \\t\\n'
    read -ra typed <<< "${COMP_LINE:0:COMP_POINT}"
    [[ "${COMP_LINE:COMP_POINT-1:1}" == " " ]] && typed+=("")
    IFS=$'\\n'
    COMPREPLY=($(hrsynth completion words -- "${typed[@]:1}" 2>/dev/null))
    last="${typed[${#typed[@]}-1]}"
    [[ "$last" == *:* && "$COMP_WORDBREAKS" == *:* ]] && COMPREPLY=("${COMPREPLY[@]#"${last%:*}:"}")
}
complete -o default -o bashdefault -F _hrsynth hrsynth""",
    "zsh": """#compdef hrsynth
_hrsynth() {
    local -a found
    found=("${(@f)$(hrsynth completion words -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    [[ -n "$found" ]] && compadd -a found
    _files
}
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }
compdef _hrsynth hrsynth""",
    "fish": """function __hrsynth_words
    set -l typed (commandline -opc)
    hrsynth completion words -- $typed[2..-1] (commandline -ct) 2>/dev/null
end
complete -c hrsynth -a '(__hrsynth_words)'""",
}


def list_completions(root: Any, typed: Sequence[str]) -> list[str]:
    """Return completions of the last typed word, which may be empty."""
    *before, last = typed or [""]
    command, used = root, 0
    while used < len(before) and before[used] in getattr(command, "commands", {}):
        command, used = command.commands[before[used]], used + 1
    return [each for each in _list_next(command, before[used:], last) if each.startswith(last)]


def _list_next(command: Any, before: Sequence[str], last: str) -> Iterable[str]:
    """Return commands of a group, values of the option before, options, or values of the argument."""
    if hasattr(command, "commands"):
        return ["--help", "--version"] if last.startswith("-") else list(command.commands)
    options: Sequence[Option] = command.options
    by_name = {name: each for each in options for name in each.names}
    named = by_name.get(before[-1]) if before else None
    if named is not None and named.kind is not bool:
        return _list_values(named, last)
    if last.startswith("-"):
        return ["--help", *(part for name in by_name for part in name.split("/") if part.startswith("--"))]
    return [word for each in options if each.argument for word in _list_values(each, last)]


def _list_values(option: Option, last: str) -> Iterable[str]:
    """Return the values of an option; for robots also ``example:NAME``, once begun."""
    words = option.words() if callable(option.words) else option.words
    if option.words is list_shipped_names and last and EXAMPLE.startswith(last[: len(EXAMPLE)]):
        from ..description import list_examples

        return [*words, *(f"{EXAMPLE}{name}" for name in list_examples())]
    return words


def add(app: Group) -> None:
    """Register the command."""

    def completion(shell: str, typed: list[str] | None) -> None:
        """Print a shell's script, or for that script the possible words."""
        from ..errors import BadRequest

        if shell == WORDS:
            for each in list_completions(app, typed or []):
                print_text(each)
        elif shell in SCRIPTS:
            print_text(SCRIPTS[shell])
        else:
            raise BadRequest("unknown shell", shell, tuple(SCRIPTS))

    add_command(
        app,
        "completion",
        "Print a completion script of commands, options and robots for bash, zsh or fish.",
        (
            Option("shell", "bash, zsh or fish.", "SHELL", default=NEEDED, argument=True, words=tuple(SCRIPTS)),
            Option("typed", "Words typed so far (used by the scripts).", "[WORD]...", list[str], argument=True),
        ),
        completion,
        ("bash >> ~/.bashrc", "zsh >> ~/.zshrc", "fish > ~/.config/fish/completions/hrsynth.fish"),
    )
