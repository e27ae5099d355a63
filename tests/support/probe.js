// Measures the page; the value is a promise of what was found.
(() => {
  const number = (text) => (text.match(/[\d.]+/g) ?? []).map(Number);
  const luminance = (rgb) => {
    const [r, g, b] = rgb.map((c) => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (a, b) => {
    const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (high + 0.05) / (low + 0.05);
  };

  // The first ground that is not transparent, from an element upwards.
  function ground(element) {
    for (let each = element; each; each = each.parentElement) {
      const rgba = number(getComputedStyle(each).backgroundColor);
      if (rgba.length && (rgba[3] ?? 1) > 0.99) return rgba.slice(0, 3);
    }
    return matchMedia("(prefers-color-scheme: dark)").matches ? [18, 18, 18] : [255, 255, 255];
  }

  function weakestText() {
    let weakest = { ratio: 99, text: "", count: 0 };
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
      const text = walker.currentNode.textContent.trim();
      const element = walker.currentNode.parentElement;
      if (!text || ["SCRIPT", "STYLE", "NOSCRIPT"].includes(element.tagName) || !element.getClientRects().length) continue;
      const style = getComputedStyle(element);
      const ink = number(element instanceof SVGElement ? style.fill : style.color).slice(0, 3);
      if (ink.length < 3) continue;
      const ratio = contrast(ink, ground(element));
      weakest = { ...(ratio < weakest.ratio ? { ratio, text: text.slice(0, 60) } : weakest), count: weakest.count + 1 };
    }
    return weakest;
  }

  // How many colours a picture has, of pixels taken all over it.
  function colours(image) {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [400, 300];
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    pen.drawImage(image, 0, 0, 400, 300);
    const pixels = new Uint32Array(pen.getImageData(0, 0, 400, 300).data.buffer);
    return new Set(pixels).size;
  }

  // What the view has drawn; read in the turn in which it is drawn, or it is gone.
  function viewed() {
    const view = document.getElementById("view");
    if (!view?.shown) return null;
    view.shown.drawNow();
    const [canvas] = view.querySelectorAll("canvas");
    const pen = new OffscreenCanvas(1, 1).getContext("2d");
    pen.drawImage(canvas, 2, 2, 1, 1, 0, 0, 1, 1);
    return {
      colours: colours(canvas), width: canvas.width, ground: [...pen.getImageData(0, 0, 1, 1).data].slice(0, 3),
      layers: view.shown.layers.filter((each) => each.shown).length, height: view.shown.eyeHeight(), floor: view.shown.scene.floor,
    };
  }

  async function measured() {
    const images = [...document.images];
    await Promise.all(images.map((image) => image.decode().catch(() => null)));
    return {
      innerWidth,
      scrollWidth: document.documentElement.scrollWidth,
      dark: matchMedia("(prefers-color-scheme: dark)").matches,
      text: weakestText(),
      images: images.map((image) => ({ id: image.id, alt: image.alt, width: image.naturalWidth, colours: image.naturalWidth ? colours(image) : 0 })),
      view: viewed(),
      focusable: document.querySelectorAll("a[href], button, input, summary, [tabindex='0']").length,
    };
  }

  // What a change of colours sets off, and what fails late, is waited for.
  return new Promise((done) => setTimeout(() => done(measured()), 400));
})();
