// A file dropped anywhere onto the window is opened.
const UNSENT = "The server does not answer, so the file was not opened. Open it again once the server is back.";
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
    if (!window.socket?.connected) { // an upload that fails is said by the server
      Quasar.Notify.create({ message: UNSENT, type: "negative", multiLine: true, timeout: 60000, actions: [{ label: "Close", color: "white" }] });
      return;
    }
    this.uploader().reset();
    this.uploader().addFiles([event.dataTransfer.files[0]]);
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
