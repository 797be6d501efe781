from pathlib import Path
p=Path('docs/explanation/robot-sim.md'); x=p.read_text()
surf=x[x.index('| surface | grip'):]; surf=surf[:surf.index('\n\n')]
new='''# The emulated robot

One process (`touchline robot-sim`, also for [several robots](../guides/robots.md)) that behaves like the robot on the grass:
it takes a trajectory, drives it, paints, and publishes its sensors' measurements, its computer's beliefs and the truth.
Everything but `service.py` and `robot_process.py` is plain code without bus, files or wall clock, so a test, a sweep and the
service run the same emulator.

```
services/robot_sim/
  fault_timeline.py      active faults; their sum in a tick is the record of world/effects.py
  world/                 the truth: 1 ms physics, valve, disc, tank, battery; the randomness
  sensors/               measurements: GNSS or the camera overhead, IMU, magnetometer, encoders
  paint/, accounting/    paint, smears and covered ground, and their figures
  emulator.py            one 10 ms tick: world → sensors → onboard → paint
  fast_runner.py         many ticks in one kernel, where nothing has to be decided
  telemetry.py           the payloads that are due after one tick or several (tick_log.py, samples.py)
  command_handlers.py    the handlers of the robot's services
  journal.py             state for a process that goes on (journal_keeper.py, setup_text.py)
  service.py             bus and signals; robot_process.py: the loop, its pace and its guards (guards.py)
```

Tick *k* covers sim time from (k−1)·10 ms to k·10 ms. The world advances ten steps of 1 ms under the command of tick k−1, the
sensors measure at its end, the computer answers, and the paint of the tick is entered in the ledger. A command therefore acts
from the next tick on.

## World

`physics.py` is the kernel of a tick, `world/body.py` has the body's state, `effects.py` what faults do. `world/drives/` and
`world/tools/` have one class for each kind of drive and tool; its figures are a named tuple with kernels that are chosen when
they are compiled (`kernel_of_class`).

- **Drive** (`differential_motors.py`): each wheel has a speed profile (first-order lag `motor_time_constant_s`, limits of
  acceleration and speed), a PI controller with feed-forward, and a DC motor with gear, dry and viscous friction, a current
  limit and the battery's voltage (33 V empty … 42 V full). Within these limits the wheels are within 0.1 rad/s of the profile.
- **Body**: mass 100 kg falling to 56 kg with the paint, yaw inertia from the radius of gyration, and casters whose rolling
  resistance acts along the direction in which they roll: after a turn or a reversal they pull aside.
- **Tyres** (`differential_ground.py`): force grows with slip and saturates at the grip, along and across together. On grass at
  1 m/s a wheel loses 0.5 % of its distance to rolling resistance and 0.8 % per m/s² of acceleration; in a curve the robot
  drifts outward by 0.37° per m/s². Each wheel also has a random slip, a Gauss-Markov process (2 %, 0.5 s).
- True wheel radii (0.3 % each, 1 σ) and track width (0.2 %) are drawn once per seed.
- **Slope**: one plane. Gravity pulls; accelerometer, magnetometer, antenna and nozzle lean with the robot; the map sees less of
  the distance uphill. A robot that is commanded to stand does not creep.
- **Rear-steered drive**: [the clay roller's](roller.md#in-the-world).
- **Sprayer**: valve and disc are plungers that travel at constant speed (valve 15 ms to open, 30 ms to close), so a pulse
  shorter than the delay does nothing. A command may switch the valve within its tick, to 1 ms. Paint flows when the valve is
  open and the tank is not empty, **whether the disc is down or not**. Flow is constant in time (`paint_l_per_m ·
  paint_speed_mps`). A clogged nozzle lets a share through and paints √share of the width, and below 5 % no line.
- **Battery**: `idle_power_w` and the motors' consumption (nothing is recovered): 131 W at 1 m/s with a full tank, 98 W with an
  empty one. Empty, it gives no torque.

'''+surf+'''

All shares of the load. They are not measured on this robot: chosen so that slip is the 2–5 % known of robots on grass, and the
battery lasts a bit over five hours. Those of clay and floor are assumed: rubber grips about as on dry concrete or linoleum (0.6
to 0.8), a small hard tyre rolls with 0.01 to 0.02 of its load. [Wet grass](../measurements/robot-sim.md) was measured.

## Sensors

`sensors/sampling.py` is the kernel of a tick: it measures (`fast.py`), takes a position when it is time (`receiver.py`) and
carries the messages over (`transport.py`). World and sensors together take about 6 µs a tick.

- **RTK-GNSS** (`receiver.py`): the solution (none, single, float, fixed), its error, the reported variance, the satellites and
  the age of corrections move together. The solution falls at once to the best that sky, signals and corrections permit, and
  climbs back step by step: position after `reacquire_s`, float after `float_after_s`, fixed after a time drawn from its range. A
  float solution leaves the former fix over about 5 s; in a fifth of its spells it claims 2 cm. Without corrections a fix is held
  and drifts for `hold_s` (the reported variance admits half of it), then the solution is single: a jump of metres. With no
  position the last one is repeated with fix 0 and a variance of 10⁴ m².
- **The fixed error** is white noise plus two Gauss-Markov terms an axis. Together they have the quantiles of a published test of
  a ZED-F9P (ArduSimple, "Testing simpleRTK2B accuracy in RTK base-rover configuration"): 12,510 fixes in 41.7 minutes at 5 Hz,
  not filtered, the antenna turning at 2.3 m/s on an arm of 0.61 m, start and stop included; 68 % within 7 mm, 95.45 % within
  17 mm, 99.73 % within 38 mm of the true place. We read the errors as horizontal distances, since the page shows the circle from
  above; ours are twice as large along the vertical. The white part is a mixture of three normal distributions: 85 % of the fixes
  with 2.05 mm an axis, 13 % with 9.5 mm, 2 % with 18.4 mm; a fix is as bad along every axis. 200,000 drawn ones come out at 7, 17
  and 38 mm within 3 % (`tests/robot_sim/test_sensors.py`); a normal distribution with the same first figure would have 11.5 and
  16 mm. How long errors last was not published: that each fix of the tail is one by itself, and that the slow terms are 2.5 mm
  each (3.5 mm together), is our choice. The whole error, 5.9 mm (1 σ) an axis, is what is reported.
- **Positions** are those of the antenna, lever arm and lean included, reported as latitude, longitude and height (WGS 84, round
  trip within 0.1 µm within 1 km), and converted back for the computer.
- **Camera overhead** (`camera.py`), for robots whose `positioning` is `overhead-camera`: 15 pictures a second, as even as ticks
  of 10 ms allow. A picture has east, north and heading of the body, with white normal noise, and comes 80 to 100 ms later; in 2 %
  of them the robot is not found. It claims its own σ, at least 1 mm and 1 mrad. Poses are on `camera/pose`
  (`geometry_msgs/PoseWithCovarianceStamped`, frame `map`). Not emulated: distortion and misalignment of the camera, hidden or
  confused robots, the edge of its view.
- **IMU**: mean rate and specific force over the tick; white noise, turn-on bias, bias walk, a bias that grows as the sensor warms
  up; gravity on slopes. Rates about x and y are those of level ground.
- **Magnetometer**: the field of northern Denmark (17.2 µT north, 47.6 µT down, declination 0) and of steel, leaning with the
  robot, through soft iron, plus hard iron, a slow disturbance and white noise: about 3.3° of heading.
- **Encoders**: cumulative angle floored to whole ticks (81,920 a revolution), random phase at switch-on.

Every random number is a hash of (seed, stream, tick, channel): adding a sensor or a fault changes no bit of any other noise.
`core/random.py` lists the streams.

## Paint

All of this is the truth, which the robot's computer never sees ([truth and belief](architecture.md#truth-and-belief)).

The ledger holds the true nozzle while paint flowed: points 10 ms apart, ends exact to 1 ms; 40 bytes each, about 14 MB for an
hour of spraying. A grid over the field finds the lines near by. Areas are computed once, at the end, with arcs cut to within
0.05 mm. Without a template the intended paint is the trajectory's sprayed stretches, moved to the nozzle.

- `coverage_pct`, `gap_m`: share (rest) of the template's length beside which the nozzle passed, spraying, within half a line
  width; exact intervals.
- `area_coverage_pct`: share of the union of the lines' bands on which paint lies.
- `within_tolerance_pct`: share of the template's length that the nozzle passed, spraying, within `tolerance_m`; decides whether
  the paint is [accepted](../reference/reports.md#whether-the-paint-is-accepted).
- **lateral error**: distance of the nozzle from its line, once per spraying tick. A tick belongs to the nearest line within 0.5 m
  that it follows (directions within 45°); below 0.1 m/s else to the line that it lies on.
- `overspray_m2`: painted area outside the union of the lines' bands; paint and bands are flat-ended strips.
- `double_paint_m2`: area under two or more passes, except within half a line width of where two lines' bands cross or join.

The report has these figures line by line (`segments`), and `width_m`: painted area per length of the line.

### Covered areas

The strokes of a tool that covers lie in the same ledger, on `truth/paint` and in the journal; there are no lines.

- **Live** (`accounting/area_raster.py`): cells of 5 cm over the areas' bounds, larger ones beyond 32 million cells (8 ha; at most
  64 MB; `cell_m`). A cell is covered when the line across the tool goes over its middle; successive steps share these lines, so no
  cell is counted twice or left out. 0.7 µs a tick. `truth/coverage` has the share of each area, `truth/area` once a second what is
  covered and covered twice.
- **At the end** (`accounting/area_metrics.py`): the flat-ended strips as exact polygons, 0.7 s for a salt pan of 93 × 47.6 m; the
  raster at 2.5 cm agrees within 0.02 % (`tests/robot_sim/test_area_accounting.py`). On `truth/area_report`.

- `coverage_pct`: share of the areas, less their holes, that the tool passed over.
- `reachable_m2`, `of_reachable_pct`: ground that the tool can lie over with the body inside the boundary and off obstacles, at any
  of 72 headings, without a margin (`core/tool_reach.py`); the share of it that was passed over.
- `planned_m2`, `of_planned_pct`: ground that the tool would pass over if it drove exactly as planned; the share of it.
- `overlap_m2`: ground under two or more strips; where a stroke turns back or has turned by 162°, another strip begins.
- `missed_m2`, `missed`: ground not passed over; its patches above 0.05 m², the largest first, each with a point inside it.
- `body_outside_m`: largest distance of the true body beyond the boundary or inside an obstacle, looked at every 2 cm.
- **lateral error**: distance of the tool from its planned path, every 10 cm.

In `traversal/report` the coverage is that of the areas, and the work is accepted if `of_planned_pct` is at least 99 %.

### Wet paint

When a traversal has ended, every wheel and caster is followed once more over the paint (`paint/smears.py`), along the true path of
the robot, kept every 2 cm (`paint/track.py`).

- A **crossing** is the middle of a wheel or caster coming upon paint that is younger than the vehicle's `drying_time_s`, as [in the
  plan](planner.md#order).
- The piece of tread on the paint takes up `smear_share · (1 − age/drying_time_s)` of it. Each time that it comes round again, 0.63 m
  further with the shipped wheels, it **prints**, as long as the line is wide, the share `exp(−distance/smear_length_m)` of that.
  Below 5 % of a line's paint nothing is seen.
- The lines stay **covered**: on grass the paint that a tread does not take remains on the blades. Prints are counted apart from
  overspray, and decide nothing.
- Dry paint is defined by ASTM D711 (no-pick-up time of traffic paint). How much is taken up, over which distance it is given off,
  the linear decline with age and the treads' sizes are **assumed**.
- For a robot that was restarted in the middle of a traversal, what was painted before counts as dry.

## Time

- `speed`: N is N× real time, 0 holds the clock, negative runs as fast as it goes (commands are looked at every 20 ms of wall time or
  sooner). A robot that cannot keep the pace does not catch up after a lag of more than 0.25 s.
- `clock="held"` (default): sim time passes only while a traversal is running or paused and for 1 s after it has ended, so a run is
  the same to the byte at any pace. `clock="free"`: sim time always passes, and a run depends on when it was started.
- A pause of the traversal is a command and changes the run; holding the clock does not.
- `load` carries the robot to the scenario's `start`, or else to the plan's begin, at rest. Tank, battery and sim time go on. With
  `here` it stays where it is, with `replace` it drives on ([traversal](onboard.md#traversal)); `resume`, `here` and `replace`
  exclude each other. While the robot drives, a load of up to 256 KiB is read, larger ones are refused unread. A load that replaces
  begins a session of its own.
- `traversal/report` is sent 1 s after a traversal has ended, when the figures are final. Estimator errors in it count from the first
  motion on.

## Goals

`traversal/goto` (`goals.py`) takes a goal ([planner](planner.md#to-a-pose)) from the console, `touchline goto` and ROS 2 alike:

- A standing robot plans from its estimate, loads `here`, and starts; if it does not know its place yet, sim time passes until it does.
- A driving robot plans from amid its drive, of which 2 s of wall clock are kept, and `replace`s it; for 10 s it tries again while it
  turns on the spot, stands or is too late.
- A paused or emergency-stopped robot refuses.

`schemas/way_start.py` decides where the path begins, also for the console's [previews](../guides/console.md#driving-to-a-goal). Of
several goals at once the newest counts. A pause, abort or e-stop cancels a goal that has not set the robot in motion yet. The answer
has the plan; a refusal is an event `goal-refused`, an accepted goal the event `goal`. From then on it is a traversal like any other.
`python -m benchmarks goals` drives robots to 1,000 random goals ([result](../measurements/tracking.md#goals)).

## Link watch

While the robot drives, at least one of the nodes `tui`, `operator` and `planner` must be on the bus. When none has been there for
`link_timeout_s` (default 2 s, wall clock), the robot pauses: valve closed at once, braking along its path, event `link-lost`. It goes
on only by `resume`. On SIGTERM or SIGINT during a traversal the robot closes its valve and brakes before the process leaves the bus.

## Journal

What remains of a job that was aborted, or whose process ended, can be done later: `traversal/load` with `resume`, then `start`, which
`g` of the [console](../guides/console.md#a-job-that-was-not-finished) and `touchline order go-on` send. With an empty trajectory the
robot takes plan and template from its journal. `traversal/unfinished` (latched, not recorded) names the job, its share done, and why it
ended. A drive to a goal leaves it as it is; the next job with work to do takes its place when it starts. Tank and battery begin as that
job has left them, unless vehicle or scenario differ.

Four files in `$XDG_STATE_HOME/touchline/` (default `~/.local/state/touchline/`), or where `touchline robot-sim --journal` says; a system
that `run`, `demo` or `fleet run` starts keeps them in a temporary folder:

- `<namespace>.journal` (`journal.py`): two slots written in turn, each with a checksum: leg, arc length, owed place, tick, elapsed time,
  fallbacks, tank and battery, sums of the estimator's error, paint. After them **the latch of an emergency stop**, with its reason. It is
  written before the order is answered, and cleared before a reset is. A robot that starts with it is emergency-stopped from its first
  status on ("emergency stop from before the restart") and refuses `load` and `start` until `reset`. It survives the process, not a power
  cut.
- `<namespace>.paint` (`paint/record.py`): the ledger's points in batches, each with a checksum over itself and all before it, entered
  before the slot that counts it. Lines, coverage and deviations are computed anew from them, to the same bits. At most 64 MiB: four hours
  of spraying, or a day of rolling (points every 5 cm, or degree of turn).
- `<namespace>.setup` (`setup_text.py`): vehicle and scenario as JSON; its hash is in every slot.
- `<namespace>.job`: the request by which the job was loaded, plan and template included.

Journal and paint are written before their paint is published. After a restart all paint is published once more, so a recording's last
traversal is always the whole job. What was kept stays until another job has started.

| trouble | effect |
| --- | --- |
| torn record | the one before, and its paint |
| paint file torn, cut off or missing | goes on with the paint before the damage; the answer and an event give the number of missing points |
| files of something else, or of another trajectory | as if there were none |
| another vehicle or scenario (its name apart) | `resume` is refused with the difference: `seed was 1, is 7`; the files stay |
| disk full, no permission, no directory | an event; the robot goes on |
| an emergency stop, and no journal can be kept | the robot stops; answer and event say that the stop would not survive a restart |
| a torn latch | counts as an emergency stop; a journal of an older layout has none |
| another robot of the namespace keeps its journal there | an event; this one keeps none |

These events (`journal`) have no part in the session's hash.

## Refilling

`sprayer/refill` and `battery/replace` (`touchline order refill`, `replace-battery`) fill the tank and put a full battery in while the
robot neither runs nor moves. The answer and an event (`tank-refilled`, `battery-replaced`) have litres or Wh before and after. A fault
that empties the tank goes on doing so until it ends.
'''
p.write_text(new)
