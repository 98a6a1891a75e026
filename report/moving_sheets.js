'use strict';
for (const figure of document.querySelectorAll('.moving-sheets:not(.runs)')) {
  const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
  const part = name => figure.querySelector('.' + name);
  const trial = part('trial'), time = part('time'), play = part('play'), stage = part('stage'), note = part('note');
  const showArrows = part('arrows'), enlarge = part('enlarge');
  const kEnlarged = 5, kScale_mm = 4;  // of errors, and the colour of the largest
  let yaw = 0.6, pitch = 0.25, zoom = 1, frame = 0, timer = null, panes = [], box = null;
  for (const [i, t] of data.trials.entries()) trial.add(new Option(t.name, i));
  if (!data.trials.some(t => t.arrows.length)) showArrows.parentElement.hidden = true;

  const here = () => data.trials[trial.value];
  const point = (list, i) => [list[3 * i], list[3 * i + 1], list[3 * i + 2]];  // tenths of a millimetre
  const colour = mm => {
    const s = Math.min(1, mm / kScale_mm);
    return `hsl(${Math.round(220 * (1 - s))} 85% ${Math.round(38 + 8 * s)}%)`;
  };

  function bounds(t) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const view of t.views)
      for (const sheet of view.sheet)
        for (let i = 0; i < sheet.length; ++i)
          if (sheet[i] !== null) {
            low[i % 3] = Math.min(low[i % 3], sheet[i]);
            high[i % 3] = Math.max(high[i % 3], sheet[i]);
          }
    return {centre: low.map((v, i) => (v + high[i]) / 2), size: Math.hypot(...low.map((v, i) => high[i] - v))};
  }

  // To the right, up, and towards the eye; z is up in the room.
  function seen(p, canvas) {
    const q = p.map((v, i) => v - box.centre[i]);
    const x = Math.cos(yaw) * q[0] + Math.sin(yaw) * q[1], y = -Math.sin(yaw) * q[0] + Math.cos(yaw) * q[1];
    const up = Math.cos(pitch) * q[2] + Math.sin(pitch) * y, near = -Math.cos(pitch) * y + Math.sin(pitch) * q[2];
    const s = 1.2 * zoom * Math.min(canvas.width, canvas.height) / box.size;
    return [canvas.width / 2 + s * x, canvas.height / 2 - s * up, near];
  }

  function line(c, a, b, style, width) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.beginPath();
    c.moveTo(a[0], a[1]);
    c.lineTo(b[0], b[1]);
    c.stroke();
  }

  function drawSheet(c, canvas, sheet, n) {
    const at = [], quads = [];
    for (let i = 0; i < n * n; ++i) at.push(seen(point(sheet, i), canvas));
    for (let r = 0; r + 1 < n; ++r)
      for (let k = 0; k + 1 < n; ++k) {
        const corners = [r * n + k, r * n + k + 1, (r + 1) * n + k + 1, (r + 1) * n + k].map(i => at[i]);
        quads.push({corners, near: corners.reduce((sum, p) => sum + p[2], 0)});
      }
    quads.sort((a, b) => a.near - b.near);
    for (const {corners: [a, b, d, e]} of quads) {
      // Light from the eye: the more a piece faces it, the brighter.
      const u = b.map((v, i) => v - a[i]), w = e.map((v, i) => v - a[i]);
      const normal = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
      const facing = Math.abs(normal[2]) / (Math.hypot(...normal) || 1);
      c.fillStyle = `hsl(35 18% ${Math.round(62 + 28 * facing)}%)`;
      c.strokeStyle = 'rgb(120 110 100 / 45%)';
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(a[0], a[1]);
      for (const p of [b, d, e]) c.lineTo(p[0], p[1]);
      c.closePath();
      c.fill();
      c.stroke();
    }
  }

  function onSheet(sheet, n, u, v) {
    const x = u * (n - 1), y = v * (n - 1), k = Math.min(n - 2, Math.floor(x)), r = Math.min(n - 2, Math.floor(y));
    const mix = (a, b, s) => a.map((value, i) => value + s * (b[i] - value));
    return mix(mix(point(sheet, r * n + k), point(sheet, r * n + k + 1), x - k),
               mix(point(sheet, (r + 1) * n + k), point(sheet, (r + 1) * n + k + 1), x - k), y - r);
  }

  function drawArrows(c, canvas, t, sheet, seconds) {
    const now = t.arrows.find(a => seconds >= a.from && seconds <= a.to);
    if (!now) return '';
    let most = 0;
    for (const a of t.arrows)
      for (let i = 0; 3 * i < a.mean.length; ++i) most = Math.max(most, Math.hypot(...point(a.mean, i)));
    for (let i = 0; 2 * i < t.uv.length; ++i) {
      const mean = point(now.mean, i), sd = Math.hypot(...point(now.sd, i)) || 1e-12, size = Math.hypot(...mean);
      const foot = onSheet(sheet, t.across, t.uv[2 * i], t.uv[2 * i + 1]);
      const a = seen(foot, canvas), b = seen(foot.map((v, k) => v + 0.2 * box.size * mean[k] / most), canvas);
      const style = size > 2 * sd ? 'rgb(190 30 90)' : 'rgb(190 30 90 / 25%)';
      line(c, a, b, style, 2.5);
      const angle = Math.atan2(b[1] - a[1], b[0] - a[0]), head = Math.min(9, Math.hypot(b[0] - a[0], b[1] - a[1]));
      for (const turn of [2.6, -2.6])
        line(c, b, [b[0] + head * Math.cos(angle + turn), b[1] + head * Math.sin(angle + turn)], style, 2.5);
    }
    return `; longest arrow ${most.toPrecision(2)} ${data.unit}`;
  }

  function drawErrors(c, canvas, t, view) {
    let sum = 0, count = 0;
    const factor = enlarge.checked ? kEnlarged : 1;
    for (let i = 0; 3 * i < t.seen[frame].length; ++i) {
      const p = point(t.seen[frame], i), e = view.expected.length ? point(view.expected[frame], i) : p;
      if (p[0] === null || e[0] === null) continue;
      const off = e.map((v, k) => v - p[k]), mm = Math.hypot(...off) / 10;
      sum += mm * mm;
      ++count;
      const at = seen(p, canvas), to = seen(p.map((v, k) => v + factor * off[k]), canvas);
      if (view.expected.length) line(c, at, to, colour(mm), 2.5);
      c.fillStyle = view.expected.length ? colour(mm) : 'rgb(190 30 90)';
      c.beginPath();
      c.arc(at[0], at[1], view.expected.length ? 4 : 2, 0, 7);
      c.fill();
    }
    return count && view.expected.length ? `${Math.sqrt(sum / count).toFixed(2)} mm off` : '';
  }

  function draw() {
    const t = here(), seconds = t.t[frame];
    box = box || bounds(t);
    for (const [i, view] of t.views.entries()) {
      const {canvas, label} = panes[i], c = canvas.getContext('2d');
      canvas.width = canvas.clientWidth * (window.devicePixelRatio || 1);
      canvas.height = canvas.clientHeight * (window.devicePixelRatio || 1);
      drawSheet(c, canvas, view.sheet[frame], t.across);
      const off = drawErrors(c, canvas, t, view);
      const last = i + 1 === t.views.length;
      const arrows = last && showArrows.checked ? drawArrows(c, canvas, t, view.sheet[frame], seconds) : '';
      label.textContent = view.name + (off ? ': ' + off : '') + arrows;
    }
    note.textContent = `${seconds.toFixed(2)} s`;
    time.value = frame;
    figure.dataset.drawn = frame;
  }

  function choose() {
    const t = here();
    stage.replaceChildren();
    panes = t.views.map(view => {
      const pane = document.createElement('div'), canvas = document.createElement('canvas');
      const label = document.createElement('div');
      canvas.setAttribute('role', 'img');
      canvas.setAttribute('aria-label', `${t.name}, ${view.name}: the sheet in motion with the recorded points`);
      pane.append(canvas, label);
      stage.append(pane);
      return {canvas, label};
    });
    time.max = t.t.length - 1;
    frame = Math.min(frame, t.t.length - 1);
    box = null;
    draw();
  }

  function toggle() {
    if (timer) {
      clearInterval(timer);
      timer = null;
    } else {
      timer = setInterval(() => {
        frame = (frame + 1) % here().t.length;
        draw();
      }, 50);
    }
    play.textContent = timer ? 'Stop' : 'Play';
  }

  trial.onchange = choose;
  time.oninput = () => {
    frame = Number(time.value);
    draw();
  };
  play.onclick = toggle;
  showArrows.onchange = enlarge.onchange = draw;
  stage.onpointerdown = event => stage.setPointerCapture(event.pointerId);
  stage.onpointermove = event => {
    if (!event.buttons) return;
    yaw -= 0.01 * event.movementX;
    pitch = Math.max(-1.5, Math.min(1.5, pitch + 0.01 * event.movementY));
    draw();
  };
  stage.tabIndex = 0;
  stage.setAttribute('role', 'group');
  stage.setAttribute('aria-label', 'sheets in motion: arrow keys turn them, plus and minus come nearer and go away');
  stage.onkeydown = event => {
    const turns = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
    const nearer = {'+': 1.1, '-': 1 / 1.1}[event.key];
    if (!turns && !nearer) return;
    event.preventDefault();
    if (turns) {
      yaw += turns[0];
      pitch = Math.max(-1.5, Math.min(1.5, pitch + turns[1]));
    } else {
      zoom = Math.max(0.3, Math.min(8, zoom * nearer));
    }
    draw();
  };
  stage.addEventListener('wheel', event => {
    event.preventDefault();
    zoom = Math.max(0.3, Math.min(8, zoom * Math.exp(-0.001 * event.deltaY)));
    draw();
  }, {passive: false});
  window.addEventListener('resize', draw);
  figure.classList.add('runs');
  choose();
}
