// The texts in view whose contrast with what they stand on is below arguments[0], with the contrast.
const least = arguments[0];

function channels(colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 1;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.fillStyle = colour;
  context.fillRect(0, 0, 1, 1);
  return [...context.getImageData(0, 0, 1, 1).data];
}

function luminance([red, green, blue]) {
  const [r, g, b] = [red, green, blue].map((value) => {
    const share = value / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function ground(element) {
  for (let each = element; each; each = each.parentElement) {
    const colour = channels(getComputedStyle(each).backgroundColor);
    if (colour[3] === 255) return colour;
  }
  return [255, 255, 255, 255];
}

const weak = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const element = walker.currentNode.parentElement;
  const words = walker.currentNode.textContent.trim();
  const box = element.getBoundingClientRect();
  if (!words || box.width < 2 || box.height < 2 || element.closest("script, style, .quiet, noscript, .skip")) continue;
  const style = getComputedStyle(element);
  if (style.visibility === "hidden") continue;
  const inside = element instanceof SVGElement ? style.fill : style.color;
  const [low, high] = [luminance(channels(inside)), luminance(ground(element))].sort((a, b) => a - b);
  const contrast = (high + 0.05) / (low + 0.05);
  if (contrast < least) weak.push(`${words.slice(0, 40)}: ${contrast.toFixed(2)}`);
}
return weak;
