// The state of the page in its address: a link opens the case again.
const dforceAddress = {
  opened: location.hash, // a link that was followed; a page that is loaded anew shows the server's document
  first() {
    const how = performance.getEntriesByType("navigation")[0]?.type;
    const link = how === "navigate" || how === undefined ? this.opened : "";
    this.opened = "";
    return link;
  },
  show(text) {
    history.replaceState(history.state, "", "#" + text);
  },
};
window.dforceAddress = dforceAddress;
// by now the page may have put its own state into the address again
window.addEventListener("hashchange", (event) => emitEvent("dforce-link", new URL(event.newURL).hash));
