/* Every visible text of a page: its beginning, its contrast to what lies behind it, and whether it is large. */
() => {
  const number = (text) => (text.match(/[\d.]+/g) || []).map(Number);
  const over = ([r, g, b, a = 1], under) => [r, g, b].map((value, i) => a * value + (1 - a) * under[i]);
  const ground = (node) => {
    const layers = [];
    for (let each = node; each; each = each.parentElement) {
      const style = getComputedStyle(each), colour = number(style.backgroundColor);
      const stops = style.backgroundImage.match(/rgba?\([^)]*\)/g);
      if (stops) layers.push(number(stops[stops.length - 1]));
      else if ((colour[3] ?? 1) > 0) layers.push(colour);
    }
    return layers.reverse().reduce((under, layer) => over(layer, under), [255, 255, 255]);
  };
  const light = (colour) => {
    const [r, g, b] = colour.map((value) => (value /= 255) <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text = walker.nextNode(); text; text = walker.nextNode()) {
    const parent = text.parentElement, style = getComputedStyle(parent);
    if (!text.textContent.trim() || !parent.checkVisibility({ checkVisibilityCSS: true, checkOpacity: true })) continue;
    if (["SCRIPT", "STYLE", "OPTION"].includes(parent.tagName)) continue;
    const under = ground(parent), ink = over(number(style.color), under);
    const [low, high] = [light(ink), light(under)].sort((a, b) => a - b);
    const size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    found.push([text.textContent.trim().slice(0, 60), (high + 0.05) / (low + 0.05), large]);
  }
  return found;
}
