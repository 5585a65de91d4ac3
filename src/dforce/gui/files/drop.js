// A file dropped anywhere onto the window is opened.
const UNSENT = "The server does not answer, or its disk is full, so the file was not opened. Open the file again later.";
const dforceFiles = {
  uploader() {
    return getElement(Number(document.querySelector(".df-upload").id.slice(1))).$refs.qRef;
  },
  pick() {
    this.uploader().reset();
    this.uploader().pickFiles();
  },
  drop(event) {
    document.body.classList.remove("df-dropping");
    if (!event.dataTransfer?.files.length) return;
    this.uploader().reset();
    this.uploader().addFiles([event.dataTransfer.files[0]]);
  },
  // said here: where an upload is cut off, the server can say nothing
  failed() {
    this.uploader().reset(); // a file that waits shuts the dialog for others
    const looks = { type: "negative", multiLine: true, timeout: 60000, group: "sentence", badgeClass: "hidden" };
    Quasar.Notify.create({ message: UNSENT, actions: [{ label: "Close", color: "white" }], ...looks });
  },
};
window.dforceFiles = dforceFiles;
document.addEventListener("dragover", (event) => {
  if (event.dataTransfer?.types.includes("Files")) document.body.classList.add("df-dropping");
});
document.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) document.body.classList.remove("df-dropping");
});
document.addEventListener("drop", (event) => dforceFiles.drop(event));
