"""What a message's value means to an app that wants a number or a truth value.

Mail comes from anybody: a value that is not what it should be is told to the app's user as a run
warning and otherwise ignored.
"""

from __future__ import annotations

from collections.abc import Callable

from mypy_extensions import mypyc_attr

from pymoos_lite.app.base import App
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import clip, parse_bool

Handler = Callable[[Message], None]


MAX_MAGNITUDE = 1e12  # beyond any honest quantity, and far from where sums of products overflow


def finite_number(message: Message) -> float | None:
    """The value as a finite number (numeric text counts) of at most `MAX_MAGNITUDE`, or None."""
    value = message.value
    if type(value) is not float:
        number = message.number
        if number is None:
            return None
        value = number
    return value if -MAX_MAGNITUDE <= value <= MAX_MAGNITUDE else None


def number_or_warning(app: App, message: Message) -> float | None:
    """The finite number in a message; a run warning and None where there is none."""
    value = message[1]
    if type(value) is float and -MAX_MAGNITUDE <= value <= MAX_MAGNITUDE:
        return value
    number = finite_number(message)
    if number is None:
        app.run_warning(f"{message.name} needs a finite number, not '{clip(message.text, 40)}'")
    return number


def on_number(app: App, use: Callable[[float], None]) -> Handler:
    """A handler that passes finite numbers to `use`, and warns of everything else and of its ValueErrors."""

    def handle(message: Message) -> None:
        number = number_or_warning(app, message)
        if number is None:
            return
        try:
            use(number)
        except ValueError as error:
            app.run_warning(f"{message.name} = {number:g}: {error}")

    return handle


def on_level(app: App, target: object, attribute: str) -> Handler:
    """As `on_number`, for numbers that are just kept in an attribute: navigation, heard many times a second."""
    warn = on_number(app, lambda value: setattr(target, attribute, value))

    def handle(message: Message) -> None:
        value = message[1]
        if type(value) is float and -MAX_MAGNITUDE <= value <= MAX_MAGNITUDE:
            setattr(target, attribute, value)
        else:
            warn(message)

    return handle


def on_truth(app: App, use: Callable[[bool], None]) -> Handler:
    """A handler that passes true or false to `use` and warns of everything else."""

    def handle(message: Message) -> None:
        value = parse_bool(message.text)
        if value is None:
            app.run_warning(f"{message.name} needs true or false, not '{clip(message.text, 40)}'")
        else:
            use(value)

    return handle


def on_text(app: App, use: Callable[[str], object]) -> Handler:
    """A handler that passes text to `use`, and turns a ValueError of it into a run warning."""

    def handle(message: Message) -> None:
        try:
            use(message.text)
        except ValueError as error:
            app.run_warning(f"{message.name} '{clip(message.text, 40)}': {error}")

    return handle


def dispatch(app: App, handlers: dict[str, Handler], mail: list[Message]) -> None:
    """Hand each message to its handler; unknown names become a run warning."""
    find = handlers.get
    for message in mail:
        handler = find(message[0])
        if handler is not None:
            handler(message)
        else:
            app.run_warning(f"Unhandled Mail: {clip(message.name, 40)}")


@mypyc_attr(allow_interpreted_subclasses=True)
class HandlerApp(App):
    """An app with a handler for each variable it wants to hear of, in `_handlers`, made by `on_start_up`."""

    _handlers: dict[str, Handler]

    def on_connect(self) -> None:
        for name in self._handlers:
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        dispatch(self, self._handlers, mail)
