// Puts Marathon into another page:
//
//   <script src="https://your.host/marathon/embed.js" data-view="#/play?agent=Ant" data-height="480"></script>
//
// data-view: the part of a link from its # on (default: the first view). data-height: in pixels (default 480).
(() => {
  const script = document.currentScript;
  const frame = document.createElement("iframe");
  const page = new URL("index.html?embed=1", script.src);
  page.hash = script.dataset.view ?? "";
  frame.src = page.href;
  frame.title = script.dataset.title ?? "Marathon";
  frame.loading = "lazy";
  frame.allow = "gamepad; fullscreen; clipboard-write";
  frame.style.cssText = `display:block;width:100%;height:${Number(script.dataset.height) || 480}px;border:0;border-radius:12px`;
  script.after(frame);
})();
