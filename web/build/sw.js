// Service worker: the page works without a network after the first visit. Each build has its own cache.
const CACHE = "marathon-__BUILD__";
const FILES = ["__FILES__"];

/** Whether a path is of the build. The list lacks the modules. */
const ours = (path) => FILES.includes(path) || path.endsWith(".wasm");

self.addEventListener("install", (event) => {
  const fill = async () => {
    const cache = await caches.open(CACHE);
    // one missing file, such as one that a host leaves out, must not prevent the rest
    await Promise.allSettled(FILES.map((file) => cache.add(new Request(file, { cache: "no-cache" }))));
    await self.skipWaiting();
  };
  event.waitUntil(fill());
});

self.addEventListener("activate", (event) => {
  const clean = async () => {
    const old = (await caches.keys()).filter((name) => name.startsWith("marathon-") && name !== CACHE);
    await Promise.all(old.map((name) => caches.delete(name)));
    await self.clients.claim();
  };
  event.waitUntil(clean());
});

// the page names the files that it loaded before this worker controlled it
self.addEventListener("message", (event) => {
  const add = async () => {
    const cache = await caches.open(CACHE);
    const loaded = event.data.loaded ?? [];
    // workers load the full module later, perhaps without a network
    const full = loaded.filter((url) => url.endsWith("-play.wasm")).map((url) => url.replace("-play.wasm", ".wasm"));
    for (const url of [...loaded, ...full]) {
      if (url.startsWith(self.registration.scope) && !(await cache.match(url))) await cache.add(url).catch(() => {});
    }
  };
  event.waitUntil(add());
});

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const { scope } = self.registration;
  if (request.method !== "GET" || !request.url.startsWith(scope)) return;
  // streams and what a program serves are not of the build
  const path = new URL(request.url).pathname.slice(new URL(scope).pathname.length);
  if (request.cache === "no-store" || (request.mode !== "navigate" && !ours(path))) return;
  const page = request.mode === "navigate";
  const answer = async () => {
    const cache = await caches.open(CACHE);
    const key = page ? "index.html" : request;
    // a page comes from the network if there is one, so that a new build is seen at once
    if (!page) {
      const known = await cache.match(key, { ignoreSearch: true });
      if (known) return known;
    }
    try {
      const response = await fetch(request);
      if (response.ok && response.type === "basic") event.waitUntil(cache.put(key, response.clone()));
      return response;
    } catch (error) {
      const known = await cache.match(key, { ignoreSearch: true });
      if (known) return known;
      throw error;
    }
  };
  event.respondWith(answer());
});
