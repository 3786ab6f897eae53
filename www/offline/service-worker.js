// @ts-nocheck: this script runs in a service worker; the build writes FILES and VERSION before it.
/**
 * Keeps the page for use without a network, where a host asks for it (the attribute `offline`). Files whose names carry a
 * hash are taken from what was kept; pages and files without a hash from the network, and from what was kept where there is
 * none. A script of the host's own that imports this one says where the page's files lie:
 * `self.SCANSTITCH = 'scanstitch/'; importScripts('scanstitch/scanstitch-offline.js');`
 */
const base = new URL(self.SCANSTITCH ?? './', self.location);
const prefix = `scanstitch ${base.href} `;
const cache_name = prefix + VERSION;
const own = new Set(FILES.map((path) => new URL(path, base).href));
const HASHED = /-[\w-]{8}\.\w+$/;

self.addEventListener('install', (event) => {
  // An older version goes on serving the pages that it opened; this one begins when they are closed.
  event.waitUntil(caches.open(cache_name).then((cache) => cache.addAll([...own])));
});

self.addEventListener('activate', (event) => {
  const forget = async () => {
    const names = await caches.keys();
    const old = names.filter((name) => name.startsWith(prefix) && name !== cache_name);
    await Promise.all(old.map((name) => caches.delete(name)));
    await self.clients.claim();
  };
  event.waitUntil(forget());
});

self.addEventListener('fetch', (event) => {
  const { request } = event;
  if (request.method !== 'GET') return;
  const address = request.url.replace(/[?#].*$/, '');
  if (own.has(address) && HASHED.test(address)) event.respondWith(kept(address, () => fetch(request)));
  else if (own.has(address) || request.mode === 'navigate') event.respondWith(fresh(request, address));
});

async function kept(address, otherwise) {
  const cache = await caches.open(cache_name);
  return (await cache.match(address)) ?? otherwise();
}

/** From the network; what it answers is kept for when there is none. */
async function fresh(request, address) {
  try {
    const response = await fetch(request);
    if (response.ok && !response.redirected) {
      const cache = await caches.open(cache_name);
      // Where the storage is full, what was kept before is still there.
      await cache.put(address, response.clone()).catch(() => undefined);
    }
    return response;
  } catch (error) {
    return kept(address, () => {
      if (request.mode === 'navigate' && address === base.href) return kept(new URL('index.html', base).href, fail);
      return fail();
    });
    function fail() {
      throw error;
    }
  }
}
