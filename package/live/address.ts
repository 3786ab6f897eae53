/** Addresses of servers: what is typed, and what a browser lets a page open. */

/** Why an address cannot be opened, and what can be done. */
export type AddressProblem = { problem: string; remedy: string };

/** How a page reaches a robot that its browser or its policy keeps from it. */
export const WAY_AROUND =
  'Start the bridge on this machine, or forward its port from the robot (ssh -N -L 8765:localhost:8765 ROBOT), and connect to ' +
  'ws://localhost:8765; or record with npx scanstitch live and drop the stream.mcap that it leaves';

/** The address of a WebSocket that is meant by what somebody typed: ws:// may be left out. */
export function socketAddress(text: string): URL | AddressProblem {
  const typed = text.trim();
  const whole = /^[a-z]+:\/\//i.test(typed) ? typed.replace(/^http/i, 'ws') : `ws://${typed}`;
  const url = URL.canParse(whole) ? new URL(whole.replace(/#.*/, '')) : null;
  if (url && /^wss?:$/.test(url.protocol)) return url;
  return {
    problem: typed === '' ? 'No address was given' : `${typed} is no address of a WebSocket`,
    remedy: 'Give one such as ws://localhost:8765',
  };
}

/** Browsers let a page that came by https open ws:// to its own machine alone. */
export function keptFrom(url: URL, pageProtocol: string): AddressProblem | null {
  if (pageProtocol !== 'https:' || url.protocol === 'wss:' || isThisMachine(url)) return null;
  return {
    problem: `This page was loaded by https, and from there browsers open ws:// to this machine only, not to ${url.hostname}`,
    remedy: WAY_AROUND,
  };
}

function isThisMachine({ hostname }: URL) {
  return /^(localhost|.*\.localhost|127(\.\d+){3}|\[::1\])$/.test(hostname);
}
