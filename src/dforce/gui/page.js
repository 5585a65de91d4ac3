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
