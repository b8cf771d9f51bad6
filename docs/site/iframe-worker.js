// The search runs in a worker, and a browser starts no worker for a page that lies in a folder (file://). This
// stands in for Worker there: it runs the script in a hidden frame. It does nothing elsewhere. The generator looks
// for "iframe-worker" in the names of scripts, and would load that of another host.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.waiting = [];
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.title = "search";
      document.body.append(frame);
      const inside = frame.contentWindow;
      const script = (address) => new Promise((resolve, reject) => {
        const element = frame.contentDocument.createElement("script");
        element.src = address;
        element.onload = resolve;
        element.onerror = reject;
        frame.contentDocument.body.append(element);
      });
      // A frame's own postMessage() would send to the frame itself; a worker's sends to the page.
      inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      inside.importScripts = (...addresses) =>
        addresses.reduce((before, address) => before.then(() => script(new URL(address, url))), Promise.resolve());
      // A worker never answers before postMessage() has returned, which is when the page begins to listen.
      this.deliver = (data) => setTimeout(() => inside.dispatchEvent(new inside.MessageEvent("message", { data })));
      script(url).then(() => {
        this.waiting.forEach(this.deliver);
        this.waiting = null;
      });
    }

    postMessage(data) {
      if (this.waiting) this.waiting.push(data);
      else this.deliver(data);
    }

    terminate() {}
  };
}
