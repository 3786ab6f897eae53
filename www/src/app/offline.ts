/** Keeps the page for use without a network, by a service worker that the host offers. */

/** Resolves when all is kept. `script`: the address of the service worker; it has to lie beside the host's page, or above. */
export async function keepForOffline(script: string): Promise<void> {
  // Without a secure origin, or in a sandboxed frame, browsers have none.
  if (!('serviceWorker' in navigator)) throw new Error('the browser has no service workers here; they need https');
  const registration = await navigator.serviceWorker.register(script, { updateViaCache: 'none' });
  const { installing } = registration;
  if (!installing) return;
  await new Promise<void>((resolve, reject) => {
    installing.addEventListener('statechange', () => {
      if (installing.state === 'redundant')
        reject(new Error('not all of its files could be kept; the storage may be full'));
      else if (installing.state !== 'installing') resolve();
    });
  });
}
