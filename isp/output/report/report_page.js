// Draws the page's plots, each into the canvas of its number, and moves the sliders of its pictures. `plots` precedes it.
'use strict';
const colours = ['#0072b2', '#d55e00', '#007a59', '#a6427c', '#b87400', '#2a8fc7', '#000000', '#8c6d31', '#7b4173',
                 '#637939', '#393b79', '#843c39'];
const shapes = ['circle', 'rect', 'triangle', 'rectRot'];
const manyPoints = 200;

// 0.001, 250, 10⁻⁷, 3·10⁸: as one would write it.
function plain(value, digits) {
  const minus = text => text.replace('-', '−');
  const size = Math.abs(value);
  if (value === 0 || (size >= 1e-4 && size < 1e6)) return minus(String(Number(value.toPrecision(digits))));
  const [mantissa, exponent] = value.toExponential(Math.min(digits - 1, 3)).split('e').map(Number);
  const raised = [...String(exponent)].map(c => c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]).join('');
  return minus((Math.abs(mantissa) === 1 ? String(mantissa).slice(0, -1) : mantissa + '·') + '10' + raised);
}

const known = (plot, key) => plot.series.flatMap(s => s[key].filter((_, k) => s.x[k] !== null && s.y[k] !== null));
const bounds = values => values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
const isJoined = (plot, x, y) =>
    plot.series.some(s => s.mark !== 'points' && s.x.some((_, k) => s.x[k] === x && s.y[k] === y));

function dataset(plot, series, i) {
  const colour = colours[i % colours.length], points = series.mark === 'points';
  const beaten = plot.named && points && !isJoined(plot, series.x[0], series.y[0]);
  const line = plot.named && !points;
  return {
    label: series.name, data: series.x.map((x, k) => ({x: x, y: series.y[k]})), showLine: !points,
    borderColor: line ? '#555' : colour, backgroundColor: beaten ? '#fff' : line ? '#555' : colour,
    borderWidth: 1.5, pointStyle: points ? shapes[(i + Math.floor(i / colours.length)) % shapes.length] : 'line',
    pointRadius: !points ? 0 : plot.named ? 5 : series.x.length > manyPoints ? 1.5 : 3,
    pointHitRadius: line ? 0 : 4, borderDash: series.mark === 'dashed' ? [5, 4] : [], tension: 0,
    order: line ? 1 : 0
  };
}

// Room around what is drawn, more around named points, for their names.
function padded(plot, values, logarithmic) {
  const positive = values.filter(v => v > 0);
  if (!logarithmic || positive.length === 0) return plot.named ? {grace: '8%'} : {};
  const [least, most] = bounds(positive);
  const factor = plot.named ? Math.max(1.5, (most / least) ** 0.1) : Math.max(1.05, (most / least) ** 0.03);
  return {min: least / factor, max: most * factor};
}

// Whole powers of ten; between them 2 and 5 where that is less than three decades, and all where it is less than one.
function isPowerTick(scale, value) {
  const decades = Math.log10(scale.max / scale.min);
  const mantissa = value / 10 ** Math.floor(Math.log10(value) + 1e-9), leading = Math.round(mantissa);
  if (Math.abs(mantissa - leading) > 1e-6) return false;
  return leading === 1 || decades < 1 || (decades < 3 && (leading === 2 || leading === 5));
}

function axis(plot, key) {
  const logarithmic = plot[key + 'Log'];
  const options = {
    type: logarithmic ? 'logarithmic' : 'linear', title: {display: true, text: plot[key + 'Label']},
    ticks: {includeBounds: !plot.equal, callback: value => plain(value, 7), maxRotation: 0}
  };
  if (logarithmic) {
    options.afterBuildTicks = scale => { scale.ticks = scale.ticks.filter(tick => isPowerTick(scale, tick.value)); };
  }
  return {...options, ...padded(plot, known(plot, key), logarithmic)};
}

const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
const inside = (a, b) => a.left >= b.left && a.right <= b.right && a.top >= b.top && a.bottom <= b.bottom;

const high = 14;  // a name
const nameFont = bold => (bold ? 'bold ' : '') + '12px ' + Chart.defaults.font.family;

// Where a name of this width can stand: beside the point, then farther and farther from it.
function* places(point, width) {
  for (let step = 0; step < 6; ++step) {
    const away = 8 + high * step;
    for (const [dx, dy] of [[1, 0], [-1, 0], [1, -1], [1, 1], [-1, -1], [-1, 1], [0, -1], [0, 1]]) {
      const reach = step === 0 || dy === 0 ? 8 : away;
      const left = point.x + (dx > 0 ? reach : dx < 0 ? -reach - width : -width / 2);
      const middle = point.y + dy * (step === 0 ? high * (dx === 0 ? 1 : 0.7) : away);
      if (dy === 0 && step > 0) continue;
      yield {left: left, right: left + width, top: middle - high / 2, bottom: middle + high / 2, step: step};
    }
  }
}

// Where that is all taken, as where many points are close together: anywhere, by how far it is.
function placesAnywhere(point, width, area) {
  const out = [], beyond = (from, to, at) => Math.max(from - at, 0, at - to);
  for (let top = area.top; top + high <= area.bottom; top += high / 2) {
    for (let left = area.left; left + width <= area.right; left += high) {
      const away = Math.hypot(beyond(left, left + width, point.x), beyond(top, top + high, point.y));
      out.push({left: left, right: left + width, top: top, bottom: top + high, step: away});
    }
  }
  return out.sort((a, b) => a.step - b.step);
}

// From a point to its name, where that does not stand beside it.
function drawLeader(ctx, {point, box}) {
  if (box.step === 0) return;
  ctx.strokeStyle = '#888';
  ctx.lineWidth = 1;
  ctx.beginPath();
  ctx.moveTo(point.x, point.y);
  ctx.lineTo(Math.max(box.left, Math.min(point.x, box.right)), box.bottom <= point.y ? box.bottom : box.top);
  ctx.stroke();
}

function drawName(ctx, {point, box}) {
  const y = (box.top + box.bottom) / 2;
  ctx.font = nameFont(point.bold);
  ctx.lineJoin = 'round';
  ctx.strokeStyle = '#fff';
  ctx.lineWidth = 3;
  ctx.strokeText(point.name, box.left, y);
  ctx.fillStyle = point.bold ? '#111' : '#555';
  ctx.fillText(point.name, box.left, y);
}

// Where the plot's lines pass, every few pixels.
function passages(chart, plot) {
  const out = [];
  plot.series.forEach((series, i) => {
    if (series.mark === 'points') return;
    const corners = chart.getDatasetMeta(i).data;
    for (let k = 1; k < corners.length; ++k) {
      const [a, b] = [corners[k - 1], corners[k]];
      const steps = Math.ceil(Math.hypot(b.x - a.x, b.y - a.y) / 4);
      for (let t = 0; t <= steps; ++t) {
        const x = a.x + (b.x - a.x) * t / steps, y = a.y + (b.y - a.y) * t / steps;
        out.push({left: x - 1, right: x + 1, top: y - 1, bottom: y + 1});
      }
    }
  });
  return out;
}

// Writes the names of a plot's points beside them: first those on a line, in bold.
function namer(plot) {
  const pointOf = chart => (series, i) => {
    const {x, y} = chart.getDatasetMeta(i).data[0];
    return {name: series.name, x: x, y: y, bold: isJoined(plot, series.x[0], series.y[0])};
  };
  const hasPlace = s => s.mark === 'points' && s.x.length === 1 && s.x[0] !== null && s.y[0] !== null;
  return {
    id: 'namer',
    afterDatasetsDraw(chart) {
      const ctx = chart.ctx, all = plot.series.map((s, i) => hasPlace(s) ? pointOf(chart)(s, i) : null).filter(p => p);
      const around = (p, by) => ({left: p.x - by, right: p.x + by, top: p.y - by, bottom: p.y + by});
      const named = [], lines = passages(chart, plot);
      ctx.save();
      ctx.textBaseline = 'middle';
      for (const point of [...all.filter(p => p.bold), ...all.filter(p => !p.bold)]) {
        ctx.font = nameFont(point.bold);
        const width = ctx.measureText(point.name).width;
        const free = box => inside(box, chart.chartArea) && !named.some(other => overlap(box, other.box)) &&
            !all.some(other => overlap(box, around(other, other === point ? 5 : 10)));
        const open = [...places(point, width)].filter(free);
        const box = open.find(place => !lines.some(line => overlap(place, line))) || open[0] ||
            placesAnywhere(point, width, chart.chartArea).find(free);
        if (box) named.push({point: point, box: box});
      }
      named.forEach(name => drawLeader(ctx, name));
      named.forEach(name => drawName(ctx, name));
      ctx.restore();
      chart.canvas.dataset.unnamed = all.length - named.length;
    }
  };
}

// One unit as long on both axes, whatever the axes' own labels leave of the canvas.
function equalise(chart, plot) {
  const {width, height} = chart.chartArea;
  const [x0, x1] = bounds(known(plot, 'x')), [y0, y1] = bounds(known(plot, 'y'));
  const unitsPerPixel = 1.1 * Math.max((x1 - x0) / width, (y1 - y0) / height);
  if (!(unitsPerPixel > 0 && isFinite(unitsPerPixel))) return;
  const range = (a, b, pixels) => ({min: (a + b - unitsPerPixel * pixels) / 2, max: (a + b + unitsPerPixel * pixels) / 2});
  Object.assign(chart.options.scales.x, range(x0, x1, width));
  Object.assign(chart.options.scales.y, range(y0, y1, height));
  chart.update('none');
}

function tooltip(plot) {
  const value = (label, v) => plain(v, 4) + (label.match(/\[(.+)\]/) ? ' ' + label.match(/\[(.+)\]/)[1] : '');
  const text = ({dataset: {label}, raw}) => `${label}: ${value(plot.xLabel, raw.x)}, ${value(plot.yLabel, raw.y)}`;
  return {callbacks: {title: () => '', label: text}};
}

function draw(plot, i) {
  const canvas = document.getElementById('plot' + i);
  const chart = new Chart(canvas, {
    type: 'scatter', data: {datasets: plot.series.map((s, k) => dataset(plot, s, k))},
    plugins: plot.named ? [namer(plot)] : [],
    options: {
      animation: false, maintainAspectRatio: false, scales: {x: axis(plot, 'x'), y: axis(plot, 'y')},
      plugins: {
        title: {display: true, text: plot.title, font: {size: 14}}, tooltip: tooltip(plot),
        legend: {display: !plot.named, position: 'bottom', labels: {usePointStyle: true, boxHeight: 8, padding: 8}}
      }
    }
  });
  if (!plot.equal) return chart;
  // The axes' labels change with their ranges, and with them the room that is left.
  const settle = () => { for (let round = 0; round < 3; ++round) equalise(chart, plot); };
  chart.options.onResize = () => setTimeout(settle);
  settle();
  return chart;
}

// As wide as there is room, and a whole multiple of the picture's own pixels where that is nearly as wide.
function fit(pair) {
  const picture = pair.querySelector('img'), frame = pair.closest('.comparison');
  const room = Math.min(576, frame.parentElement.clientWidth), own = picture.naturalWidth / devicePixelRatio;
  const whole = Math.floor(room / own) * own;
  const exact = whole >= 0.75 * room;
  frame.style.flexBasis = (exact ? whole : room) + 'px';
  pair.classList.toggle('exact', exact);
}

function compare(pair) {
  const slider = pair.querySelector('input');
  const [before, after] = [...pair.querySelectorAll('img')].map(picture => picture.alt);
  const show = () => {
    pair.style.setProperty('--at', slider.value + '%');
    slider.setAttribute('aria-valuetext', `${slider.value} % ${before}, ${100 - slider.value} % ${after}`);
  };
  slider.addEventListener('input', show);
  show();
}

Chart.defaults.color = '#222';
Chart.defaults.borderColor = '#ddd';
Chart.defaults.font.family = 'system-ui, sans-serif';
const charts = plots.map(draw);
const pairs = [...document.querySelectorAll('.pair')];
pairs.forEach(compare);
addEventListener('load', () => pairs.forEach(fit));
addEventListener('resize', () => pairs.forEach(fit));
addEventListener('beforeprint', () => charts.forEach(chart => chart.resize()));
addEventListener('afterprint', () => charts.forEach(chart => chart.resize()));
