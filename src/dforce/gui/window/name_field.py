"""The search box of a name on the first page, which takes the first match at Enter and where it is left."""

from __future__ import annotations

from nicegui import ui
from nicegui.events import GenericEventArguments

# Enter takes the first of the names that match the input, once their list is there
MARK = """(text) => text && setTimeout(() => {
    const list = getElement(%d).$refs.qRef;
    if (list?.getOptionIndex() === -1) list.moveOptionSelection(1, true);
}, 100)"""
# taken in the browser, so that the name comes before the press of the button for which the field is left
TAKE = """(event) => {
    if (event.relatedTarget?.closest(".q-menu")) return;
    const field = getElement(%d), list = field.$refs.qRef, text = field.$el.querySelector("input").value.trim();
    if (!text || text === list.modelValue?.label) return emit("");
    const found = field.initialOptions.filter((one) => one.label.toLowerCase().includes(text.toLowerCase()));
    if (found.length) list.add(found.find((one) => one.label === text) ?? found[0]);
    emit(found.length ? "" : text);
}"""
# by Enter, too, where it is pressed before the first match is marked
ENTER = "(event) => getElement(%d).$refs.qRef.getOptionIndex() === -1 && (%s)(event)"


class NameField(ui.select):
    """A choice of names with a search box; its error is an input that matches no name."""

    def __init__(self, labels: dict[str, str], noun: str) -> None:
        super().__init__(labels, label=noun.capitalize(), with_input=True, clearable=True)
        self.noun = noun
        self.on("input-value", js_handler=MARK % self.id)
        self.on("focusout", self._leave, js_handler=TAKE % self.id)
        self.on("keydown.enter", self._leave, js_handler=ENTER % (self.id, TAKE % self.id))

    def _leave(self, event: GenericEventArguments) -> None:
        self.error = (
            f"No {self.noun} matches “{str(event.args)[:30]}”; type your values after Start." if event.args else None
        )
