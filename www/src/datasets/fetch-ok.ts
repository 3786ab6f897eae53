/** The answer of a server, where it is one of success. */
export async function fetchOk(url: string): Promise<Response> {
  return okOnly(await fetch(url), url);
}

/** Throws where the server refused; `address` is what the message calls it. */
export function okOnly(response: Response, address: string): Response {
  if (!response.ok) throw new Error(`${address} answered ${response.status} ${response.statusText}`);
  return response;
}
