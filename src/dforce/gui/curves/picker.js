// The choice of the picture: one of the usual pictures, or any quantities against any other.
export default {
  template: `
    <div class="df-picker" @keydown.esc="close" ref="all">
      <select class="df-box" aria-label="picture" :value="chosen" @change="$emit('picture', Number($event.target.value))">
        <option v-for="(title, n) in titles" :key="n" :value="n">{{ title }}</option>
        <option v-if="chosen < 0" :value="-1">own choice</option>
      </select>
      <button type="button" class="df-plain" ref="opener" :aria-expanded="open ? 'true' : 'false'" :aria-controls="uid"
              @click="open = !open">Quantities <span aria-hidden="true">▾</span></button>
      <div v-if="open" :id="uid" class="df-popover" role="group" aria-label="quantities of the picture">
        <label class="df-against">against
          <select class="df-box" :value="x" @change="say({x: $event.target.value})">
            <option v-for="one in all" :key="one.name" :value="one.name">{{ one.text }}</option>
          </select>
        </label>
        <div class="df-checks">
          <label v-for="one in able" :key="one.name" class="df-check" :title="one.help">
            <input type="checkbox" :checked="y.includes(one.name)" :disabled="y.length === 1 && y.includes(one.name)"
                   @change="toggle(one.name, $event.target.checked)" />
            <span>{{ one.label }}</span><span class="df-symbol" v-html="one.symbol"></span>
            <span class="df-check-unit">{{ one.unit }}</span>
          </label>
        </div>
        <div class="df-switches">
          <label class="df-check"><input type="checkbox" :checked="together" @change="say({together: $event.target.checked})" />
            <span>in one frame, an axis for each unit</span></label>
          <label class="df-check"><input type="checkbox" :checked="logarithmic"
                 @change="say({logarithmic: $event.target.checked})" /><span>logarithmic</span></label>
        </div>
      </div>
    </div>`,
  props: {
    titles: { default: () => [] }, chosen: { default: 0 }, all: { default: () => [] }, x: { default: "" },
    y: { default: () => [] }, together: Boolean, logarithmic: Boolean,
  },
  data() {
    return { open: false, uid: "picker-" + Math.random().toString(36).slice(2) };
  },
  computed: {
    able() {
      const row = this.all.find((one) => one.name === this.x)?.row;
      return this.all.filter((one) => one.row === row && one.name !== this.x);
    },
  },
  mounted() {
    this.outside = (event) => {
      if (this.open && !this.$refs.all.contains(event.target)) this.open = false;
    };
    document.addEventListener("pointerdown", this.outside);
  },
  beforeUnmount() {
    document.removeEventListener("pointerdown", this.outside);
  },
  methods: {
    close() {
      if (!this.open) return;
      this.open = false;
      this.$refs.opener.focus();
    },
    toggle(name, on) {
      this.say({ y: on ? [...this.y, name] : this.y.filter((one) => one !== name) });
    },
    say(change) {
      this.$emit("own", { x: this.x, y: this.y, together: this.together, logarithmic: this.logarithmic, ...change });
    },
  },
};
