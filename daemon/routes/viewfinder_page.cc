#include "daemon/routes/viewfinder_page.h"

namespace opaline::daemon {

std::string_view viewfinder_page() {
  return R"html(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Viewfinder</title>
<meta name="viewport" content="width=device-width">
<style>
body { margin: 0; background: #181818; color: #ddd; font: 15px/1.5 sans-serif; }
main { display: flex; flex-wrap: wrap; gap: 1rem; padding: 1rem; }
img { width: 960px; max-width: 100%; align-self: start; background: #000; image-rendering: pixelated; }
section { min-width: 19rem; flex: 1; }
#state { font-size: 1.2rem; }
.figure { font-size: 2rem; font-variant-numeric: tabular-nums; }
.bad { color: #f6a; }
canvas { background: #222; width: 100%; height: 90px; }
button { font: inherit; padding: .4rem .8rem; }
dl { display: grid; grid-template-columns: 9rem 1fr; margin: .5rem 0; } dd { margin: 0; }
</style></head><body><main>
<img id="picture" src="stream" alt="what the camera sees">
<section>
<div id="state">waiting for the first picture</div>
<div>focus <span class="figure" id="focus">-</span> of <span id="best">-</span></div>
<canvas id="history" width="300" height="90"></canvas>
<dl><dt>saturated</dt><dd id="saturated"></dd><dt>lit</dt><dd id="lit"></dd><dt>exposure</dt><dd id="exposure"></dd>
<dt id="cornerslabel"></dt><dd id="corners"></dd></dl>
<p id="next"></p>
<p id="answers" hidden><button data-answer="take">take this pose</button> <button data-answer="enough">enough poses</button></p>
<p>Magenta pixels are saturated; the strip below the picture has each channel's histogram.</p>
</section></main>
<script>
const at = id => document.getElementById(id);
const past = [];
function draw() {
  const canvas = at('history'), pen = canvas.getContext('2d'), most = Math.max(...past, 1e-12);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.strokeStyle = '#6c6';
  pen.beginPath();
  past.forEach((f, i) => pen.lineTo(i * canvas.width / 120, canvas.height * (1 - .95 * f / most)));
  pen.stroke();
}
function show(v) {
  at('state').textContent = v.station + ': ' + (v.step || v.by) + (v.doing ? ', ' + v.doing : '');
  if (v.focus !== undefined) {
    at('focus').textContent = v.focus.toPrecision(3);
    at('best').textContent = 'best ' + v.best_focus.toPrecision(3);
    past.push(v.focus);
    if (past.length > 120) past.shift();
    draw();
    const full = Math.max(...v.saturated);
    at('saturated').textContent = (100 * full).toFixed(2) + ' %';
    at('saturated').className = full > .001 ? 'bad' : '';
    at('lit').textContent = (100 * v.coverage).toFixed(0) + ' % of the picture';
    at('exposure').textContent = v.exposure_s.toPrecision(3) + ' s';
  }
  at('answers').hidden = !v.board;
  if (v.board) {
    at('cornerslabel').textContent = 'pose ' + v.board.pose + ' of ' + v.board.poses;
    at('corners').textContent = v.board.fault || v.board.corners + ' corners, blurred by ' + v.board.blur_px.toFixed(2) +
        ' px, so far in ' + (100 * v.board.coverage).toFixed(0) + ' % of the picture';
    at('next').textContent = 'Next: the board ' + v.board.next;
  }
}
const events = new EventSource('events');
events.addEventListener('view', e => show(JSON.parse(e.data)));
events.addEventListener('over', e => {
  const v = JSON.parse(e.data);
  at('state').textContent = v.station + ': ' + v.state + ' ' + v.message;
  events.close();
});
at('answers').addEventListener('click', e => {
  const answer = e.target.dataset.answer;
  if (answer) fetch('answer', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify({answer})});
});
</script></body></html>
)html";
}

}  // namespace opaline::daemon
