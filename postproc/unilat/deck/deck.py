"""A deck: its cards, their text, and what can be done with it.

    deck = Deck("Euler's column")
    deck.node((1, 0.0, 0.0), (2, 1.0, 0.0))
    deck.line((1, 2), elset="COLUMN")
    deck.beam_section((1e6, 1.0), elset="COLUMN", section="STIFFNESS")
    deck.boundary((1, "PINNED"), (2, 2))
    deck.monitor((2, "U1", -1), name="shortening")
    with deck.step() as step:
        step.static((0.5, 1e-6, 2.0), method="LOAD")
        step.cload((2, 1, -1.0))
        step.stop(("LOAD", "ABOVE", 12.0))
    results = deck.run()

Every card of the program is a method; help(deck.static) says what it takes. Values are checked by the program, which knows the
whole deck: deck.check(), or a run, raises DeckError with its message, line and column.
"""

from __future__ import annotations

import html
import os
import tempfile

from .. import program
from ..results import Results, ResultsError, read_results
from . import card_table, running
from .card import Card
from .deck_text import cards_of
from .errors import DeckError, places_of


class _Cards:
    """A list of cards with a method for every card of the program."""

    places: tuple[str, ...] = ()

    def __init__(self):
        self.cards: list = []        # Card or Step

    def add(self, *cards):
        """Puts cards at the end, those of the model part above the first step; the last one of them."""
        for card in cards:
            first = next((k for k, each in enumerate(self.cards) if isinstance(each, Step)), len(self.cards))
            of_model = isinstance(card, Card) and card.spec.get("where") == "model"
            self.cards.insert(first if of_model else len(self.cards), card)
        return cards[-1] if cards else None

    def find(self, keyword: str, **parameters) -> list[Card]:
        """All cards with this keyword and these parameters, in their order; those in steps, too."""
        wanted = " ".join(keyword.upper().replace("_", " ").split())
        found = []
        for card in self.cards:
            if isinstance(card, Step):
                found += card.find(keyword, **parameters)
            elif card.keyword == wanted and all(str(card.get(name)).upper() == str(value).upper() for name, value in parameters.items()):
                found.append(card)
        return found

    def __getattr__(self, name: str):
        if name.startswith("_"):
            raise AttributeError(name)
        for keyword in card_table.table():
            if card_table.python_name(keyword) == name:
                return _adder(self, card_table.card_class(keyword))
        known = ", ".join(card_table.python_name(keyword) for keyword in card_table.table())
        raise AttributeError(f"{type(self).__name__} has no '{name}', and the program no such card (cards: {known})")

    def __dir__(self):
        try:
            own = [card_table.python_name(keyword) for keyword, spec in card_table.table().items()
                   if spec["where"] in self.places and keyword not in ("STEP", "END STEP")]
        except ResultsError:
            own = []
        return sorted({*super().__dir__(), *own})


def _adder(cards: _Cards, made: type[Card]):
    """The method that makes a card and adds it."""
    def add(*lines, **parameters):
        return cards.add(made(*lines, **parameters))
    add.__name__ = add.__qualname__ = card_table.python_name(made.keyword)
    add.__doc__, add.__signature__ = made.__doc__, made.__signature__
    return add


class Step(_Cards):
    """The cards between *STEP and *END STEP."""

    places = ("step", "anywhere")

    def __init__(self, head: Card):
        super().__init__()
        self.head = head
        self.end = card_table.card_class("END STEP")()

    def __enter__(self) -> Step:
        return self

    def __exit__(self, *_):
        pass

    def all_cards(self) -> list[Card]:
        return [self.head, *self.cards, self.end]

    def __repr__(self) -> str:
        return f"<{self.head.head()}: {len(self.cards)} cards>"


class Deck(_Cards):
    __doc__ = __doc__
    places = ("model", "anywhere", "outside steps")

    def __init__(self, title: str | None = None, job: str | None = None):
        super().__init__()
        self.folder = ""             # where included decks are looked for; '': the working directory
        self.comments: list[str] = []        # behind the last card
        if title is not None or job is not None:
            self.add(card_table.card_class("HEADING")(title or "", job=job))

    @classmethod
    def read(cls, filename: str | os.PathLike) -> Deck:
        """The deck in a file; comments stay where they are."""
        filename = os.fspath(filename)
        try:
            with open(filename, encoding="utf-8") as file:
                text = file.read()
        except (OSError, UnicodeDecodeError) as problem:
            raise ResultsError(f"{filename}: cannot be read: {getattr(problem, 'strerror', None) or 'this is no text'}") from problem
        deck = cls.from_text(text)
        deck.folder = os.path.dirname(os.path.abspath(filename))
        return deck

    @classmethod
    def from_text(cls, text: str) -> Deck:
        """The deck of a text."""
        deck = cls()
        cards, deck.comments = cards_of(text)
        step = None
        for card in cards:
            if card.keyword == "STEP" and step is None:
                step = deck.add(Step(card))
            elif card.keyword == "END STEP" and step is not None:
                step.end, step = card, None
            else:
                (step or deck).cards.append(card)       # where it stands, be it right or wrong
        return deck

    def step(self, **parameters) -> Step:
        """A new step at the end of the deck; its cards are added to what this returns. Parameters are those of *STEP."""
        return self.add(Step(card_table.card_class("STEP")(**parameters)))

    @property
    def steps(self) -> list[Step]:
        return [card for card in self.cards if isinstance(card, Step)]

    def all_cards(self) -> list[Card]:
        """The cards in the order of the text."""
        return [card for each in self.cards for card in (each.all_cards() if isinstance(each, Step) else [each])]

    def text(self) -> str:
        """What the program reads."""
        return "".join(card.text() for card in self.all_cards()) + "".join(f"{line}\n" for line in self.comments)

    def write(self, filename: str | os.PathLike) -> str:
        """Writes the deck; the name of the file. Included decks are named from where it lies."""
        filename = os.fspath(filename)
        text = self._text_for(os.path.dirname(os.path.abspath(filename)))
        try:
            with open(filename, "w", encoding="utf-8") as file:
                file.write(text)
        except OSError as problem:
            raise ResultsError(f"{filename}: cannot be written: {problem.strerror}") from problem
        return filename

    def check(self, **values) -> str:
        """What the program understands of the deck, computing nothing; DeckError when something is wrong. `values`: of parameters."""
        with tempfile.TemporaryDirectory() as folder:
            name = self.write(os.path.join(folder, "deck.inp"))
            done = program.ask(program.find_program(), ["--check", *running.settings(values), name])
            self._raise_error(done.returncode, done.stderr.replace(f"{folder}{os.sep}", ""))
            return done.stdout

    def model(self, **values) -> Results:
        """The model without a path: mesh, supports, loads, obstacles, sets; as the program understands it."""
        with tempfile.TemporaryDirectory() as folder:
            name = self.write(os.path.join(folder, "deck.inp"))
            output = os.path.join(folder, "model.h5")
            done = program.ask(program.find_program(), ["--model", "-o", output, *running.settings(values), name])
            self._raise_error(done.returncode, done.stderr.replace(f"{folder}{os.sep}", ""))
            return read_results(output)

    def plot(self, **options):
        """A picture of the model before a run; options are those of `unilat-plot model`, such as labels="nodes"."""
        from ..pictures import draw      # needs matplotlib
        with tempfile.TemporaryDirectory() as folder:
            name = self.write(os.path.join(folder, "deck.inp"))
            done = program.ask(program.find_program(), ["--model", "-o", os.path.join(folder, "model.h5"), name])
            self._raise_error(done.returncode, done.stderr.replace(f"{folder}{os.sep}", ""))
            return draw("model", [os.path.join(folder, "model.h5")], options)

    def run(self, folder: str | os.PathLike | None = None, name: str | None = None, progress=True, partial: bool = False,
            timeout: float | None = None, **values) -> Results:
        """Runs the deck and reads its results; `results.listing` is what the program prints.

        `folder`: where deck, listing and results go (NAME.inp, NAME.lst, NAME.h5); None: a temporary one that lives as long as
        the results. `progress`: True, False, or a function that gets (points, load factor). `values`: of the deck's
        parameters. `partial`: a path that stopped early is returned with a warning, not raised.

        DeckError: the program does not accept the deck; PathStopped: the path ended early (its `results` are there);
        ProgramError: the program failed, or took longer than `timeout` seconds.
        """
        return running.run(self, folder, name or self._job(), progress, partial, timeout, values)

    def sweep(self, **options):
        """Many runs with other values of the parameters, on this machine's cores or as a Slurm job array; see unilat.deck.varying."""
        from .varying import sweep
        return sweep(self, **options)

    def evaluate(self, values: list[dict], gather: dict[str, str] | str = "LP", **options):
        """Quantities of runs with given values of the parameters, all at a time; see unilat.deck.varying."""
        from .varying import evaluate
        return evaluate(self, values, gather, **options)

    def minimise(self, quantity: str, between: dict[str, tuple[float, float]], **options):
        """The values of parameters that make a quantity least; see unilat.deck.varying."""
        from .varying import optimise
        return optimise(self, quantity, between, least=True, **options)

    def maximise(self, quantity: str, between: dict[str, tuple[float, float]], **options):
        """The values of parameters that make a quantity largest; see unilat.deck.varying."""
        from .varying import optimise
        return optimise(self, quantity, between, least=False, **options)

    def card_at(self, line: int) -> Card | None:
        """The card that writes a line of the text, from 1."""
        number = 0
        for card in self.all_cards():
            number += card.text().count("\n")
            if line <= number:
                return card
        return None

    def __repr__(self) -> str:
        heading = next((card for card in self.cards if not isinstance(card, Step) and card.keyword == "HEADING"), None)
        title = str(heading.lines[0]).strip() if heading is not None and heading.lines else "no title"
        return f"<Deck '{title}': {len(self.all_cards())} cards, {len(self.steps)} steps>"

    def _repr_html_(self) -> str:
        return f"<details><summary>{html.escape(repr(self))}</summary><pre>{html.escape(self.text())}</pre></details>"

    def _job(self) -> str:
        heading = next((card for card in self.cards if not isinstance(card, Step) and card.keyword == "HEADING"), None)
        return str(heading.get("JOB") or "deck") if heading is not None else "deck"

    def _text_for(self, folder: str) -> str:
        """The text with the names of included decks as they are seen from a folder."""
        home = self.folder or os.getcwd()
        if os.path.abspath(home) == os.path.abspath(folder):
            return self.text()
        included = [(card, card.parameters.get("FILE")) for card in self.all_cards() if card.keyword == "INCLUDE"]
        try:
            for card, name in included:
                if isinstance(name, str) and not os.path.isabs(name) and "${" not in name:
                    card.parameters["FILE"] = os.path.join(home, name)
            return self.text()
        finally:
            for card, name in included:
                card.parameters["FILE"] = name

    def _raise_error(self, code: int, report: str):
        """DeckError when the program did not accept the deck."""
        if code == 1:
            report = report.rstrip()
            places = places_of(report, lambda file, line: self.card_at(line) if os.path.basename(file).endswith(".inp") else None)
            raise DeckError(report, places)
        if code not in (0, 2):
            raise running.failed(code, report)
