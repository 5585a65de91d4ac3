// From disk a browser fetches no page, so Sphinx's search would show titles without excerpts: it gets its texts from texts.js.
if (location.protocol === "file:") {
  let texts;
  window.fetch = async (url) => {
    texts ??= new Promise((done) => {
      window.dforceTexts = done;
      const script = document.createElement("script");
      script.src = "_static/texts.js";
      document.head.append(script);
    });
    const page = new URL(url, location.href).pathname.slice(new URL(".", location.href).pathname.length);
    return new Response(`<main role="main">${(await texts)[decodeURIComponent(page).replace(/\.html$/, "")] ?? ""}</main>`);
  };
}
