/** A file inside the script: compressed by gzip, in base64 (vite.element.ts). */
declare module '*?packed' {
  const base64: string;
  export default base64;
}
