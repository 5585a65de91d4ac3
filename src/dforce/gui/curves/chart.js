// A chart by Plotly: typed arrays, zoom that survives a redraw, and an answer once it is drawn.
const NARROW = 320; // px, below which titles of axes are smaller
const PHONE = 600; // px, width of a window with little room: titles of several frames are smaller, and buttons would lie over a title
const LABEL = 15; // px, the room of a number at an upright axis
const MOST = 6; // numbers at an upright axis of a frame
const POWER = 22; // px, the room of a power of ten
const DECADES = 7; // of a logarithmic axis
const OTHER = 20; // px, another height, for which the numbers of frames are chosen anew
const MEASURED = /^(fit|measured|residual) /, STATES = /^states /; // the traces beside the curves of results
const FREE = 600, GHOST = 6000; // ms after the hand is off until the axes follow again, and until the ghost goes
const WALKED = (meta) => !["jump", "ghost"].includes(meta) && !MEASURED.test(meta ?? "") && !STATES.test(meta ?? "");
// of a figure: values that a slider moves are left out, the numbers of lines and the places of rings
const moving = (key, value) => ((/^[xy]$/.test(key) && value?.bdata) || (/^[xy]anchor$/.test(key) && Number.isFinite(value)) ? 0 : value);
const known = (trace) => [...trace.x.keys()].filter((n) => Number.isFinite(trace.x[n]) && Number.isFinite(trace.y[n]));
let plotly = null;

function load(url) {
  plotly ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = url;
    script.onload = () => resolve(window.Plotly);
    script.onerror = () => reject(new Error("the chart library could not be loaded"));
    document.head.appendChild(script);
  });
  return plotly;
}

let palette = null; // reading styles makes the browser lay the page out anew, so they are read once a theme

function colors() {
  palette ??= readColors();
  return palette;
}

function readColors() {
  const style = getComputedStyle(document.body);
  const get = (name) => style.getPropertyValue(name).trim();
  return {
    ink: get("--df-ink"), soft: get("--df-soft"), grid: get("--df-grid"), paper: get("--df-paper"), line: get("--df-line"),
    series: [0, 1, 2, 3, 4, 5].map((n) => get("--df-series-" + n)),
  };
}

function themed(figure, narrow, height) {
  const c = colors();
  const of = (name) => (typeof name === "number" ? c.series[name % c.series.length] : c[name] ?? name);
  const layout = structuredClone(figure.layout ?? {});
  Object.assign(layout, {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", autosize: true, uirevision: layout.uirevision ?? "kept",
    font: { family: "Inter, system-ui, 'Segoe UI', Roboto, sans-serif", size: 12, color: c.ink },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: c.soft, activecolor: c.ink },
    hoverlabel: { bgcolor: c.paper, bordercolor: c.line, font: { color: c.ink, size: 12 } },
  });
  for (const key of Object.keys(layout).filter((k) => /^[xy]axis\d*$/.test(k))) {
    const axis = layout[key];
    const own = axis.color === undefined ? undefined : of(axis.color);
    delete axis.color;
    layout[key] = {
      gridcolor: c.grid, linecolor: c.line, zerolinecolor: c.line, tickcolor: c.line, showline: true, ticks: "outside",
      ticklen: 4, automargin: false, zeroline: false, type: "linear",
      ticklabeloverflow: "allow", // the margins have room for labels, and measuring each takes long
      ...axis,
      tickfont: { color: own ?? c.soft, size: 11 },
      title: { standoff: 8, ...axis.title, font: { size: narrow ? 10 : 12, color: own ?? c.ink } },
    };
  }
  for (const key of Object.keys(layout).filter((k) => /^yaxis\d*$/.test(k))) {
    const { title, domain: [bottom, top] = [0, 1] } = layout[key];
    if (top - bottom === 1) continue; // of several frames each has its title above, where it has room
    (layout.annotations ??= []).push({
      text: title.text, font: window.innerWidth < PHONE ? { ...title.font, size: 10 } : title.font, showarrow: false, borderpad: 0, xref: "x domain", x: 0, xanchor: "left",
      yref: key.replace("axis", "") + " domain", y: 1, yanchor: "bottom",
    });
    const room = height * (top - bottom);
    Object.assign(layout[key], { title: { text: "" }, nticks: Math.min(Math.max(2, Math.floor(room / LABEL)), MOST) });
    if (layout[key].type === "log") layout[key].dtick = Math.ceil(DECADES / Math.max(1, Math.floor(room / POWER)));
  }
  if (narrow) {
    if (layout.legend?.yref === "container") layout.showlegend = false; // above the frames it would take their room
    const further = Object.values(layout).filter((one) => one?.anchor === "free");
    for (const axis of further) axis.visible = false;
    if (further.length) Object.assign(layout.margin, { l: 64, r: 64 });
  }
  if (layout.legend) layout.legend = { font: { color: c.soft, size: 11 }, bgcolor: "rgba(0,0,0,0)", ...layout.legend };
  for (const note of layout.annotations ?? []) note.font = { ...note.font, color: note.font?.color ?? c.soft };
  for (const shape of layout.shapes ?? []) if (shape.line) shape.line.color = of(shape.line.color ?? "line");
  const data = (figure.data ?? []).map((trace) => {
    const copy = { ...trace };
    for (const key of ["x", "y"]) if (copy[key]?.bdata) copy[key] = { ...copy[key] }; // a move writes into it: a ghost has its own
    if (copy.line) copy.line = { ...copy.line, color: of(copy.line.color) };
    if (Array.isArray(copy.colorscale)) copy.colorscale = copy.colorscale.map(([at, name]) => [at, of(name)]);
    if (copy.marker) copy.marker = { ...copy.marker, color: of(copy.marker.color) };
    return copy;
  });
  return { data, layout };
}

const isDark = () => document.body.classList.contains("body--dark");

export default {
  template: `
    <div class="df-chart" :class="{stale}" role="figure" :aria-label="label" :data-revision="revision"
         :tabindex="walks ? 0 : -1" @focus="said = walks ? KEYS : ''" @keydown="walk">
      <div ref="plot" class="df-plot"></div>
      <p v-if="walks" class="df-hidden" role="status">{{ said }}</p>
    </div>`,
  props: { library: String, label: { default: "" }, holds: Boolean, walks: Boolean },
  data() {
    return { revision: 0, stale: false, said: "", KEYS: "Arrow keys move along a curve and to the next curve. Enter chooses the point." };
  },
  async mounted() {
    this.figure = null;
    this.drawn = false;
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(this.$el);
    this.dark = isDark();
    this.theme = new MutationObserver(() => {
      if (isDark() === this.dark) return; // the class of the body changes with every menu that opens
      this.dark = isDark();
      palette = null;
      if (this.figure) this.paint();
    });
    this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    if (this.holds) {
      window.addEventListener("df-hold", this.hold);
      window.addEventListener("df-release", this.release);
    }
    await load(this.library);
  },
  beforeUnmount() {
    window.removeEventListener("df-hold", this.hold);
    window.removeEventListener("df-release", this.release);
    clearTimeout(this.later);
    this.observer.disconnect();
    this.theme.disconnect();
    if (this.drawn) window.Plotly.purge(this.$refs.plot);
  },
  methods: {
    async draw(figure, revision) {
      await load(this.library);
      if (!this.$refs.plot) return revision;
      this.figure = figure;
      await this.paint();
      if (!this.drawn) {
        this.drawn = true;
        this.$refs.plot.on("plotly_click", (event) => {
          const point = this.nearest(event);
          this.$emit("point", { revision: this.revision, curve: point.curveNumber, index: point.pointIndex, x: point.x, y: point.y, id: point.data.meta });
        });
        this.$refs.plot.on("plotly_relayout", (changed) => {
          const place = changed["shapes[0].y0"];
          if (Number.isFinite(place)) this.$emit("limit", place);
        });
        this.fit();
      }
      this.revision = revision;
      return revision;
    },
    // Arrow keys go along a curve, and up and down to the next one; Enter is a click.
    walk(event) {
      const plot = this.$refs.plot, along = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -1e9, End: 1e9 }[event.key];
      const across = { ArrowUp: -1, ArrowDown: 1 }[event.key];
      if (!this.walks || !this.drawn || event.target !== this.$el || !(along || across || event.key === "Enter")) return;
      const curves = plot._fullData.filter((trace) => trace.visible === true && trace.mode === "lines" && WALKED(trace.meta) && known(trace).length);
      if (!curves.length) return;
      event.preventDefault();
      const before = curves.findIndex((trace) => trace.index === this.at?.curve);
      const trace = curves[Math.min(Math.max(Math.max(before, 0) + (before < 0 ? 0 : across ?? 0), 0), curves.length - 1)];
      const points = known(trace), near = (x) => points.reduce((best, n) => (Math.abs(trace.x[n] - x) < Math.abs(trace.x[best] - x) ? n : best));
      const here = before < 0 ? -1 : points.indexOf(trace.index === this.at.curve ? this.at.point : near(this.at.x));
      const point = points[Math.min(Math.max(here + (along ?? (before < 0 ? 1 : 0)), 0), points.length - 1)];
      const [x, y] = [trace.x[point], trace.y[point]];
      this.at = { curve: trace.index, point, x };
      window.Plotly.Fx.hover(plot, [{ curveNumber: trace.index, pointNumber: point }], [trace.xaxis + trace.yaxis]);
      const words = (axis) => (this.figure.layout[axis[0] + "axis" + axis.slice(1)].title?.text ?? "").replace(/<[^>]*>/g, "");
      this.said = `${trace.name}, ${words(trace.xaxis)}: ${x.toPrecision(4)}, ${words(trace.yaxis)}: ${y.toPrecision(4)}`;
      if (event.key === "Enter") this.$emit("point", { revision: this.revision, curve: trace.index, index: point, x, y, id: trace.meta });
    },
    // of all points at one place across, which a unified hover gives, the one of the curve that was clicked
    nearest({ points, event }) {
      const curves = points.filter((point) => point.yaxis && !MEASURED.test(point.data.meta ?? ""));
      if (curves.length < 2) return curves[0] ?? points[0];
      const top = this.$refs.plot.getBoundingClientRect().top;
      const away = ({ yaxis, y }) => Math.abs(top + yaxis._offset + yaxis.d2p(y) - event.clientY);
      return curves.reduce((best, point) => (away(point) < away(best) ? point : best));
    },
    async paint() {
      const figure = this.figure;
      await this.moved;
      if (figure !== this.figure) return; // a newer one came meanwhile
      this.narrow = this.$el.clientWidth < NARROW;
      this.height = this.$el.clientHeight;
      const { t = 0, b = 0 } = figure.layout?.margin ?? {};
      const { data, layout } = themed(this.held(), this.narrow, this.height - t - b);
      // no button that sends a chart to another host
      const config = { showSendToCloud: false, plotlyServerURL: "", displaylogo: false, responsive: false,
                       displayModeBar: window.innerWidth >= PHONE && (this.figure.bar ?? false), scrollZoom: false, doubleClick: "reset",
                       modeBarButtonsToRemove: ["lasso2d", "select2d", "toImage"],
                       edits: { shapePosition: this.figure.drag ?? false } };
      // a move draws lines for the present size, and leaves the axes at the one before
      const size = [this.$el.clientWidth, this.height];
      const look = this.ranges ? JSON.stringify([data, layout, size], moving) : null;
      if (look !== null && look === this.look) await this.move(data, layout);
      else await window.Plotly.react(this.$refs.plot, data, layout, config);
      this.look = look;
    },
    // Axes that stand still and a legend that says the same need not be drawn again with lines and rings: half the time.
    // Plotly draws them right after its event; its own promise comes a frame later, and only then it is ready for the next.
    move(data, layout) {
      const lines = data.slice(0, this.figure.data.length).map(({ x, y }) => ({ x, y })); // the ghost stays
      const drawn = new Promise((then) => this.$refs.plot.once("plotly_transitioning", () => queueMicrotask(then)));
      const frame = { data: lines, traces: [...lines.keys()], layout: { shapes: layout.shapes } };
      const atOnce = { mode: "immediate", frame: { duration: 0, redraw: false }, transition: { duration: 0 } };
      this.moved = window.Plotly.animate(this.$refs.plot, frame, atOnce);
      return drawn;
    },
    // While a slider is dragged the axes stand still, and the curves from which one came stay as a ghost.
    hold() {
      clearTimeout(this.later);
      if (!this.drawn || this.ranges) return;
      const now = this.$refs.plot._fullLayout;
      const axes = Object.keys(this.figure.layout).filter((key) => /^[xy]axis\d*$/.test(key));
      this.ranges = Object.fromEntries(axes.map((key) => [key, [...now[key].range]]));
      const lines = this.figure.data.filter((trace) => trace.mode === "lines" && !MEASURED.test(trace.meta ?? "") && !STATES.test(trace.meta ?? ""));
      this.ghost = lines.map((trace, n) => ({
        ...trace, line: { color: "soft", width: 1.5, dash: trace.line?.dash ?? "solid" }, opacity: 0.55, meta: "ghost",
        name: "before", showlegend: n === 0, hovertemplate: undefined, hoverinfo: "skip",
      }));
    },
    release() {
      clearTimeout(this.later);
      this.later = setTimeout(() => {
        this.ranges = null;
        if (this.figure) this.paint();
        this.later = setTimeout(() => {
          this.ghost = null;
          if (this.figure) this.paint();
        }, GHOST);
      }, FREE);
    },
    held() {
      const layout = { ...this.figure.layout };
      for (const [key, range] of Object.entries(this.ranges ?? {})) {
        if (layout[key]) layout[key] = { ...layout[key], range, autorange: false };
      }
      return { ...this.figure, layout, data: [...(this.figure.data ?? []), ...(this.ghost ?? [])] };
    },
    dim(stale) {
      this.stale = stale;
    },
    fit() {
      if (!this.drawn || this.$el.clientWidth === 0) return;
      const other = Math.abs(this.$el.clientHeight - this.height) > OTHER;
      if (this.$el.clientWidth < NARROW !== this.narrow || other) this.paint();
      else window.Plotly.Plots.resize(this.$refs.plot);
    },
  },
};
