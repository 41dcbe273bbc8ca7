/* The moment at which a mission is shown if it does not play. */

/** A moment with many robots out and at work, about half of the map known: a little after a plan, in ms.
    @type {(mission: Mission) => number} */
export function openingMoment(mission) {
  const whole = mission.openArea(mission.to) || 1;
  let best = mission.from + (mission.to - mission.from) / 2;
  let most = -Infinity;
  for (const plan of mission.plans) {
    const t = Math.min(plan.t_ms + 2000, mission.to - 1);
    const views = mission.views(t);
    const busy = views.filter((view) => !view.carrier && view.action).length / views.length;
    const out = views.filter((view) => !view.carrier).length / views.length;
    const worth = busy + 1.5 * out - Math.abs(mission.openArea(t) / whole - 0.5);
    if (worth > most) {
      most = worth;
      best = t;
    }
  }
  return best;
}
