// The live picture with the silhouette and the stripe quality drawn on it.
import { by, number, say } from "./dom.js";

const canvas = by("preview"), context = canvas.getContext("2d");
const picture = new Image();
let overlay = null;

// Of the contrast between dark and bright stripes, grey levels; edges are found from 20 on.
const colour = ([, , contrast, white]) =>
  (white > 20      ? "rgba(255,255,255,.55)" :
     contrast < 20 ? "rgba(240,90,80,.42)" :
     contrast < 50 ? "rgba(245,185,60,.34)" :
                     "rgba(60,205,140,.26)");

function draw() {
  if (!picture.naturalWidth || !overlay) return;
  canvas.width = overlay.width;
  canvas.height = overlay.height;
  context.drawImage(picture, 0, 0, overlay.width, overlay.height);
  if (by("show-tiles").checked) {
    for (const tile of overlay.tiles) {
      context.fillStyle = colour(tile);
      context.fillRect(tile[0], tile[1], overlay.tile - 1, overlay.tile - 1);
    }
  }
  if (by("show-outline").checked) {
    context.lineWidth = 2;
    context.strokeStyle = "#5fe0c8";
    context.shadowColor = "#000";
    context.shadowBlur = 3;
    for (const curve of overlay.outline) {
      context.beginPath();
      for (let i = 0; i < curve.length; i += 2) context.lineTo(curve[i], curve[i + 1]);
      context.closePath();
      context.stroke();
    }
    context.shadowBlur = 0;
  }
}

picture.addEventListener("load", draw);
for (const id of ["show-outline", "show-tiles"]) by(id).addEventListener("change", draw);

export function showPreview(preview) {
  overlay = preview.overlay;
  picture.src = "data:image/png;base64," + preview.png;
  by("no-preview").hidden = true;
  const tiles = overlay.tiles, plain = tiles.filter((t) => t[2] >= 50 && t[3] <= 20).length,
        faint = tiles.filter((t) => t[2] < 20).length;
  say(
    by("quality"),
    tiles.length ?
      `${number((100 * plain) / tiles.length, 0)} % plain, ${number((100 * faint) / tiles.length, 0)} % faint` :
      overlay.outline.length ? "no stripes shown" :
                               "no fabric seen");
  say(by("preview-age"), `frame ${preview.number}`);
}
