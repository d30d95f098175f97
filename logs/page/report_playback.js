// The viewer's own page in a frame; its connection is a recording (services/viewer/page/recording.js).
async function unpacked(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).text();
}

// A module's address; what it imports has addresses of its own.
const moduleUrls = {};
function moduleUrl(name) {
  return moduleUrls[name] ??= (async () => {
    let text = await unpacked(viewerFiles[name]);
    for (const [imported] of [...text.matchAll(/(?<=['"])\.\/[\w.]+\.js(?=['"])/g)])
      text = text.replaceAll(imported, await moduleUrl(imported.slice(2)));
    return URL.createObjectURL(new Blob([text], {type: 'text/javascript'}));
  })();
}

const playback = {frame: null, flight: null};

async function openPlayback(flight, start = 0) {
  playback.flight = flight;
  window.chaseRecordingOf = () => ({...flight.playback, start});
  const html = (await unpacked(viewerFiles['index.html']))
    .replace('<link rel="stylesheet" href="style.css">', `<style>${await unpacked(viewerFiles['style.css'])}</style>`)
    .replace(`<script type="module" src="main.js">`,  // its end stays: none may stand in this script
      `<script>window.chaseRecording = parent.chaseRecordingOf();<${''}/script><script type="module" src="${await moduleUrl('main.js')}">`);
  const frame = document.createElement('iframe');
  frame.title = 'the flight, played';
  frame.srcdoc = html;
  document.getElementById('playback').querySelector('iframe')?.remove();
  document.getElementById('playback').append(frame);
  playback.frame = frame;
}

// `t`: of the report.
function seekPlayback(t) {
  const inside = playback.frame?.contentWindow.chase;
  inside?.link.ask({seek: t - playback.flight.playback.begin});
}

const playbackTime = () => {
  const play = playback.frame?.contentWindow?.chase?.model.play;
  return play ? play.t + playback.flight.playback.begin : null;
};
