'use strict';
for (const figure of document.querySelectorAll('.flipped:not(.runs)')) {
  const part = name => figure.querySelector('.' + name), pairs = [...figure.querySelectorAll('.pair')];
  const which = part('which'), over = part('over'), differ = part('differ'), nearer = part('nearer'),
        flip = part('flip');
  let timer = null;
  for (const [i, pair] of pairs.entries()) which.add(new Option(pair.dataset.name, i));

  function draw() {
    for (const [i, pair] of pairs.entries()) {
      pair.hidden = i !== Number(which.value);
      pair.style.width = `${100 * nearer.value}%`;
      pair.style.setProperty('--over', differ.checked ? 1 : over.value / 100);
      pair.style.setProperty('--blend', differ.checked ? 'difference' : 'normal');
      pair.classList.toggle('difference', differ.checked);
    }
    figure.dataset.shown = differ.checked ? 'difference' : `${over.value} %`;
  }

  function stop() {
    clearInterval(timer);
    timer = null;
    flip.textContent = 'Flip';
  }

  // From the one to the other, twice a second, until it is pressed again.
  flip.onclick = () => {
    if (timer) return stop();
    const turn = () => {
      differ.checked = false;
      over.value = Number(over.value) < 50 ? 100 : 0;
      draw();
    };
    turn();
    timer = setInterval(turn, 500);
    flip.textContent = 'Stop';
  };
  over.oninput = differ.onchange = () => {
    stop();
    draw();
  };
  which.onchange = nearer.oninput = draw;
  figure.classList.add('runs');
  draw();
}
