#include "client/shapectl/curve_answer.h"
#include "client/shapectl/curve_output.h"
#include "client/shapectl/motion_source.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "shaped/v1/curves.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Smooth {
  std::string in, template_file, out, plot, energy_plot;
  std::vector<std::string> held;
  double restore = 0, restore_scale = 0, bending = 0;
  std::int64_t window = 0;
  bool closed = false;
  FlowFlags flow;

  void declare(Arguments& arguments) {
    arguments.positional("IN", in, "The motion: n x V x 3 .npy, metres, or a dataset on the daemon");
    arguments.option("--template", template_file, "T.ply", "A mesh of its connectivity");
    arguments.option("-o,--out", out, "OUT.npy", "The smoothed motion");
    arguments.required();
    flow.declare(arguments, "10");
    arguments.option("--restore", restore, "RHO", "How strongly frames are pulled to what they were, 0 to 1 (0)");
    arguments.option("--restore-scale", restore_scale, "METRES",
                     "Pull vertices instead of shapes: smooths noise of finer patterns, keeps coarser motion (0: off)");
    arguments.flag("--closed", closed, "The first frame follows the last; otherwise both stay as they are");
    arguments.option("--hold", held, "FRAME", "Frames to leave as they are, by index");
    arguments.option("--window", window, "N", "Frames that are smoothed at once (160)");
    arguments.option("--bending", bending, "ETA", "Bending weight [m^2] (2.5e-5 times the squared diameter)");
    arguments.option("--plot", plot, "P.svg", "Draw how sharp the motion's corner is at each frame, before and after");
    arguments.option("--plot-energy", energy_plot, "P.svg", "Draw the path energy over the steps");
  }

  ExitCode run(const Session& session) const {
    v1::SmoothRequest request = requestFor();
    const MotionSource motion(session, {in}, template_file);
    request.set_dataset(motion.names().front());
    client::Call call(session.callOptions());
    const auto stub = v1::Curves::NewStub(session.channel());
    const auto stream = stub->Smooth(call.context(), request);
    const auto summary = receiveCurve(*stream, out);
    if (!plot.empty()) writeFile(plot, gradientPlot(summary, in));
    if (!energy_plot.empty()) writeFile(energy_plot, energyPlot(summary, in));
    printSmoothing(summary, {}, out, session);
    return exitCodeOf(summary.report());
  }

 private:
  v1::SmoothRequest requestFor() const {
    v1::SmoothRequest request;
    flow.fill(*request.mutable_flow());
    request.set_closed(closed);
    request.add_restore(restore);
    request.set_restore_scale(restore_scale);
    for (const auto& frame : held) request.add_held(indexOf(frame));
    request.set_window(countOf("--window", window));
    request.set_bending(bending);
    return request;
  }

  static std::uint32_t indexOf(const std::string& text) {
    std::size_t used = 0;
    unsigned long index = 0;
    try {
      index = std::stoul(text, &used);
    } catch (const std::exception&) {
    }
    if (used == 0 || used != text.size() || text[0] == '-' || index > std::numeric_limits<std::uint32_t>::max())
      throw InvalidInput("--hold", "\"" + text + "\" is no frame's index, want 0 or more");
    return static_cast<std::uint32_t>(index);
  }
};

}  // namespace

Verb smoothVerb() { return makeVerb<Smooth>("smooth", "Smooth or repair a motion, without shrinking limbs"); }

}  // namespace shaped::shapectl
