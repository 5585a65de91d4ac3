// A file dropped anywhere onto the window is opened.
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
};
window.dforceFiles = dforceFiles;
document.addEventListener("dragover", (event) => {
  if (event.dataTransfer?.types.includes("Files")) document.body.classList.add("df-dropping");
});
document.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) document.body.classList.remove("df-dropping");
});
document.addEventListener("drop", (event) => dforceFiles.drop(event));
