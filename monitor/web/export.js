// Files that the browser saves.

import { element } from "./dom.js";

export function save(name, content, type) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  const link = element("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

// What is drawn, as a PNG file.
export function savePicture(name, canvas) {
  return new Promise((resolve) => {
    canvas.toBlob((blob) => {
      if (blob) save(name, blob, "image/png");
      resolve(Boolean(blob));
    }, "image/png");
  });
}
