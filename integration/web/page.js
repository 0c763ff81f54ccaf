// The page of a motion or of what was felt: verdict, frames that play with overlays, curves. The data stand in the element "palpate-data" (see
// web_page.h for what each of its fields is); NiiVue draws the volumes.
'use strict';

const data = JSON.parse(document.getElementById('palpate-data').textContent);
const root = document.querySelector('main');
const frameCount = data.frame_labels.length;

/** An element with attributes and children; strings become text. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function vector(tag, attributes = {}, text = '') {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = text;
  return made;
}

/** Three digits, without an exponent where that is short. */
function numberText(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size < 0.001 || size >= 1e5)) return value.toExponential(2);
  return String(Number(value.toPrecision(3))).replace('-', '−');
}

// What shows which frame is seen: the viewer, the slider and the plots.
const frameListeners = [];
let frame = 0;
function showFrame(next) {
  frame = ((next % frameCount) + frameCount) % frameCount;
  for (const listener of frameListeners) listener(frame);
}

function headerParts() {
  const parts = [element('h1', {}, data.title), element('p', {class: 'soft'}, data.subtitle)];
  if (data.verdict) {
    const list = element('ul');
    for (const reason of data.verdict.reasons) list.append(element('li', {}, reason));
    parts.push(element('div', {class: 'card', id: 'verdict'},
      element('p', {}, 'Verdict: ', element('span', {class: `word ${data.verdict.word}`}, data.verdict.word)), list));
  }
  return parts;
}

/** Curves over time, with a line at the frame that is seen. */
function plotFigure(plot) {
  const width = 420, height = 200, left = 52, right = 12, top = 10, bottom = 34;
  const finite = (values) => values.filter(Number.isFinite);
  const xs = finite(plot.curves.flatMap((curve) => curve.x)), ys = finite(plot.curves.flatMap((curve) => curve.y));
  const [x0, x1] = [Math.min(...xs), Math.max(...xs)];
  let [y0, y1] = [Math.min(...ys, plot.from_zero ? 0 : Infinity), Math.max(...ys)];
  if (!(y1 > y0)) y1 = y0 + (Math.abs(y0) || 1);
  const px = (x) => left + (width - left - right) * (x1 > x0 ? (x - x0) / (x1 - x0) : 0.5);
  const py = (y) => height - bottom - (height - top - bottom) * (y - y0) / (y1 - y0);
  const svg = vector('svg', {viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': plot.title});
  for (const [value, anchor] of [[y0, 'end'], [y1, 'end']]) {
    svg.append(vector('line', {class: 'axis', x1: left, x2: width - right, y1: py(value), y2: py(value)}));
    svg.append(vector('text', {x: left - 6, y: py(value) + 4, 'text-anchor': anchor}, numberText(value)));
  }
  for (const [value, anchor] of [[x0, 'start'], [x1, 'end']])
    svg.append(vector('text', {x: px(value), y: height - bottom + 16, 'text-anchor': anchor}, numberText(value)));
  svg.append(vector('text', {x: (left + width - right) / 2, y: height - 4, 'text-anchor': 'middle'}, plot.x_label));
  plot.curves.forEach((curve, n) => {
    // A value that is missing interrupts the line.
    let path = '', pen = 'M';
    curve.x.forEach((x, k) => {
      if (!Number.isFinite(curve.y[k])) { pen = 'M'; return; }
      path += `${pen}${px(x).toFixed(1)} ${py(curve.y[k]).toFixed(1)}`;
      pen = 'L';
    });
    svg.append(vector('path', {d: path, fill: 'none', stroke: curveColor(n), 'stroke-width': 2}));
  });
  const now = vector('line', {class: 'now', y1: top, y2: height - bottom});
  if (plot.follows_frames) {
    svg.append(now);
    frameListeners.push((k) => {
      const x = px(data.frame_times[k]);
      now.setAttribute('x1', x);
      now.setAttribute('x2', x);
    });
  }
  const names = element('div', {class: 'names soft'});
  if (plot.curves.length > 1)
    plot.curves.forEach((curve, n) => names.append(element('span', {style: `--of: ${curveColor(n)}`}, curve.name)));
  return element('figure', {}, element('figcaption', {}, plot.title), names, svg);
}

// Okabe and Ito's colours, which the colour-blind can tell apart.
function curveColor(n) {
  return ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9'][n % 6];
}

function choice(label, options, chosen, onChange) {
  const select = element('select', {'aria-label': label});
  options.forEach(([value, text]) => select.append(element('option', {value}, text)));
  select.value = chosen;
  select.addEventListener('change', () => onChange(select.value));
  return element('label', {}, label, select);
}

function drawLegend(legend, volume) {
  legend.replaceChildren();
  if (!volume) return;
  const colors = niivue.cmapper.colormap(volume.colormap);
  const bar = element('canvas', {width: 256, height: 1});
  const context = bar.getContext('2d');
  const row = context.createImageData(256, 1);
  for (let n = 0; n < 256; ++n) row.data.set([colors[4 * n], colors[4 * n + 1], colors[4 * n + 2], 255], 4 * n);
  context.putImageData(row, 0, 0);
  legend.append(numberText(volume.low), bar, `${numberText(volume.high)} ${volume.unit}`,
    element('span', {class: 'soft'}, volume.note));
}

async function viewerParts() {
  const canvas = element('canvas', {'aria-label': 'Slices and a 3D view of the frames'});
  const place = element('div', {class: 'place soft', id: 'place'});
  const card = element('div', {class: 'card'}, element('div', {class: 'viewer'}, canvas));
  root.append(card);
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const backColor = () => (dark.matches ? [0.08, 0.09, 0.1, 1] : [0.92, 0.93, 0.94, 1]);
  const nv = new niivue.Niivue({backColor: backColor(), show3Dcrosshair: true, logLevel: 'error',
    multiplanarForceRender: true, renderOverlayBlend: 0.3, gradientOpacity: 0.4, isRadiologicalConvention: true, dragAndDropEnabled: false,
    crosshairWidth: 0.5, crosshairColor: [0.95, 0.45, 0.1, 0.9],
    fontColor: dark.matches ? [0.85, 0.88, 0.9, 1] : [0.25, 0.28, 0.3, 1], loadingText: 'One moment'});
  await nv.attachToCanvas(canvas);
  // Blue below the middle, orange above it, nothing in the middle.
  nv.addColormap('decrease-increase', {R: [0, 86, 255, 230, 213], G: [114, 180, 255, 159, 94], B: [178, 233, 255, 0, 0],
    A: [220, 160, 0, 160, 220], I: [0, 96, 128, 160, 255]});
  dark.addEventListener('change', () => { nv.opts.backColor = backColor(); nv.drawScene(); });

  // Volumes: the frames first, then what lies over them.
  const images = [];
  for (const volume of data.volumes) {
    const image = await niivue.NVImage.loadFromBase64({base64: volume.nifti, name: `${volume.name}.nii.gz`,
      colormap: volume.role === 'labels' ? 'gray' : volume.colormap, cal_min: volume.low, cal_max: volume.high,
      opacity: volume.role === 'frames' ? 1 : 0, trustCalMinMax: false});
    if (volume.role === 'labels') image.setColormapLabel(volume.label_colors);
    nv.addVolume(image);
    images.push(image);
  }
  const overlays = data.volumes.map((volume, n) => [volume, n]).filter(([volume]) => volume.role === 'overlay');
  const labels = data.volumes.findIndex((volume) => volume.role === 'labels');
  const legend = element('div', {class: 'legend', id: 'legend'});
  let overlay = overlays.length ? overlays[0][1] : -1, opacity = 0.4, segments = labels >= 0;

  const refresh = () => {
    data.volumes.forEach((volume, n) => {
      const inTime = volume.frame_count === 1 || frame < volume.frame_count;
      const shown = volume.role === 'frames' ? 1 : volume.role === 'labels' ? (segments ? 0.3 : 0) : n === overlay ? opacity : 0;
      images[n].opacity = inTime ? shown : 0;
      if (volume.frame_count > 1 && inTime) images[n].frame4D = frame;
    });
    nv.updateGLVolume();
    drawLegend(legend, overlay >= 0 ? data.volumes[overlay] : null);
  };
  nv.onLocationChange = (location) => {
    // NiiVue's axes are RAS, palpate's LPS.
    const [x, y, z] = location.mm;
    const values = location.values.map((value, n) => [data.volumes[n], value.value])
      .filter(([volume], n) => images[n].opacity > 0 && volume.role !== 'labels')
      .map(([volume, value]) => `${volume.title} ${numberText(value)}${volume.unit ? ' ' + volume.unit : ''}`);
    place.textContent = `L ${numberText(-x)}, P ${numberText(-y)}, S ${numberText(z)} mm: ${values.join(', ')}`;
  };

  const controls = element('div', {class: 'controls'});
  if (frameCount > 1) controls.append(...playControls());
  card.append(controls);
  const more = element('div', {class: 'controls'});
  if (overlays.length) {
    more.append(choice('Overlay', [...overlays.map(([volume, n]) => [String(n), volume.title]), ['-1', 'none']], String(overlay),
      (value) => { overlay = Number(value); refresh(); }));
    const strength = element('input', {type: 'range', min: 0, max: 1, step: 0.05, value: opacity, 'aria-label': 'Opacity of the overlay'});
    strength.addEventListener('input', () => { opacity = Number(strength.value); refresh(); });
    more.append(element('label', {}, 'Opacity', strength));
  }
  if (labels >= 0) {
    const box = element('input', {type: 'checkbox', checked: '', 'aria-label': 'Segments'});
    box.addEventListener('change', () => { segments = box.checked; refresh(); });
    const {labels: names, R, G, B} = data.volumes[labels].label_colors;
    const keys = names.slice(1).map((name, n) =>
      element('span', {style: `--of: rgb(${R[n + 1]}, ${G[n + 1]}, ${B[n + 1]})`}, name));
    more.append(element('label', {}, box, data.volumes[labels].title), element('div', {class: 'names'}, ...keys));
  }
  more.append(choice('View', [['3', 'slices and 3D'], ['4', '3D'], ['0', 'axial'], ['1', 'coronal'], ['2', 'sagittal']], '3',
    (value) => nv.setSliceType(Number(value))));
  card.append(more, legend, place);
  frameListeners.push(refresh);
  window.palpateViewer = nv;  // for whoever looks at the page with a program
}

function playControls() {
  const slider = element('input', {type: 'range', min: 0, max: frameCount - 1, step: 1, value: 0, 'aria-label': 'Frame', id: 'frame'});
  const text = element('span', {class: 'soft', id: 'frame-label'});
  slider.addEventListener('input', () => showFrame(Number(slider.value)));
  frameListeners.push((k) => { slider.value = k; text.textContent = data.frame_labels[k]; });

  // Plays in the sequence's own time, or slower: a step is shown when its time has come.
  const button = element('button', {type: 'button', id: 'play'}, 'Play');
  let since = null, from = 0, speed = 1;
  const period = data.period_s;
  const tick = (now) => {
    if (since === null) return;
    const at = (from + (now - since) / 1000 * speed) % period;
    let k = 0;
    while (k + 1 < frameCount && data.play_times_s[k + 1] <= at) ++k;
    if (k !== frame) showFrame(k);
    requestAnimationFrame(tick);
  };
  const start = () => { since = performance.now(); from = data.play_times_s[frame]; requestAnimationFrame(tick); };
  const toggle = () => {
    if (since === null) start(); else since = null;
    button.textContent = since === null ? 'Play' : 'Pause';
  };
  button.addEventListener('click', toggle);
  document.addEventListener('keydown', (event) => {
    if (event.key !== ' ' || ['BUTTON', 'INPUT', 'SELECT', 'SUMMARY'].includes(event.target.tagName)) return;
    event.preventDefault();
    toggle();
  });
  return [button, element('label', {class: 'frame'}, slider), text,
    choice('Speed', [['1', '1 ×'], ['0.5', '1/2 ×'], ['0.25', '1/4 ×'], ['0.1', '1/10 ×']], '1', (value) => {
      speed = Number(value);
      if (since !== null) start();
    })];
}

function endParts() {
  const parts = [];
  if (data.plots.length)
    parts.push(element('h2', {}, 'Over time'), element('div', {class: 'plots'}, ...data.plots.map(plotFigure)));
  const table = element('table');
  for (const [name, value] of data.facts) table.append(element('tr', {}, element('td', {}, name), element('td', {}, value)));
  parts.push(element('h2', {}, 'Numbers'), element('div', {class: 'card'}, table));
  parts.push(element('details', {}, element('summary', {}, 'Licences of what is inside this page'),
    element('pre', {}, document.getElementById('licences').textContent)));
  return parts;
}

(async () => {
  root.append(...headerParts());
  if (data.volumes.length) {
    try {
      await viewerParts();
    } catch (error) {
      root.append(element('p', {class: 'card', id: 'no-viewer'},
        `The volumes can not be shown: this browser has no WebGL 2, or not enough memory (${error.message || error}).`));
    }
  }
  root.append(...endParts());
  showFrame(0);
  document.body.dataset.ready = 'yes';
})();
