// Input that has not reached the server is kept, so that a cut connection or a restart of the server loses nothing.
const dforceUnsent = {
  KEY: "dforce-unsent",
  OLDEST: 3600e3, // ms
  number: 0,
  all() {
    try {
      return JSON.parse(sessionStorage.getItem(this.KEY)) ?? {};
    } catch {
      return {};
    }
  },
  save(all) {
    sessionStorage.setItem(this.KEY, JSON.stringify(all));
  },
  put(name, text, unit) {
    this.number = Math.max(this.number + 1, Date.now()); // none that a page before this one used
    this.save({ ...this.all(), [name]: { text, unit, number: this.number, time: Date.now() } });
    return this.number;
  },
  arrived(name, number) {
    const all = this.all();
    if (all[name]?.number !== number) return;
    delete all[name];
    this.save(all);
  },
  // Called by the server when it has made the forms anew: it knows the fields of before no more.
  forget() {
    sessionStorage.removeItem(this.KEY);
  },
  // Called by the server once a page is there: input that the page before could not send. It stays until the server has it.
  left() {
    return Object.entries(this.all())
      .filter(([, one]) => Date.now() - one.time < this.OLDEST)
      .map(([name, one]) => [name, one.text, one.unit, one.number]);
  },
};
window.dforceUnsent = dforceUnsent;
// A text in which no line ends between a symbol, its number, error and unit.
window.dforceWhole = (text) => text.replace(/(?<=[\d=±]) (?=\S)|(?<=\S) (?=[=±%])|(?<=Pa) (?=s\b)/g, "\u00a0");
// A page that was left does not come back, unlike one whose connection was cut; one that the browser keeps may.
window.addEventListener("pagehide", (event) => {
  if (!event.persisted) emitEvent("left");
});
// Shows, below the forms, the sentence about the field that is in use or under the pointer.
for (const kind of ["focusin", "mouseover"]) {
  document.addEventListener(kind, (event) => {
    const entry = event.target.closest?.(".df-entry");
    const help = document.getElementById("df-help");
    if (!entry || !help) return;
    help.replaceChildren();
    const name = document.createElement("code");
    name.textContent = entry.dataset.name;
    help.append(name, " " + entry.dataset.help);
  });
}
// A file dropped beside a place that takes it must not replace the page.
for (const kind of ["dragover", "drop"]) {
  document.addEventListener(kind, (event) => {
    if (!event.target.closest?.(".q-uploader, .df-drop")) event.preventDefault();
  });
}
// Where a dialog ends, the keyboard goes on from where it was, also where a menu between both has gone.
const dforceFocus = {
  before: null,
  back() {
    const now = document.activeElement; // nowhere, in a menu that goes, too, or on a part of the button
    if (now === document.body || now.closest(".q-menu") || this.before?.contains(now)) this.before?.focus();
  },
  // to the new element, once it is there
  go(place, preventScroll = false) {
    requestAnimationFrame(() => requestAnimationFrame(() => {
      this.before = document.querySelector(place);
      this.before?.focus({ preventScroll });
    }));
  },
};
window.dforceFocus = dforceFocus;
document.addEventListener("focusin", (event) => {
  const helper = event.target.matches(".q-focus-helper"); // within a button that a pointer pressed
  if (!event.target.closest(".q-menu, .q-dialog")) dforceFocus.before = helper ? event.target.parentElement : event.target;
});
// Arrow keys go through an open menu, and through the tabs in sight; Quasar stays before one that is hidden.
document.addEventListener("keydown", (event) => {
  const isTab = event.target.matches?.('[role="tab"]');
  const list = event.target.closest?.(isTab ? '[role="tablist"]' : '.q-menu, [role="menu"]');
  const items = [...(list?.querySelectorAll(`[role="${isTab ? "tab" : "menuitem"}"]`) ?? [])].filter((one) => one.offsetParent);
  const here = items.indexOf(event.target), last = items.length - 1;
  const [next, before] = isTab ? ["ArrowRight", "ArrowLeft"] : ["ArrowDown", "ArrowUp"];
  const goal = { Home: 0, End: last, [next]: here < last ? here + 1 : 0, [before]: here > 0 ? here - 1 : last }[event.key];
  if (!items[goal]) return;
  event.preventDefault();
  event.stopPropagation();
  items[goal].focus();
}, true);
