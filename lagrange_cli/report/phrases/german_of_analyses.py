"""Phrases of analyses and other forms in German: English → German, with the same parts."""

from __future__ import annotations

GERMAN_OF_ANALYSES = {
    "Equilibria": "Gleichgewichte",
    "these are all": "das sind alle",
    "these are all where {names} is not 0": "das sind alle, wenn {names} nicht 0 ist",
    "these are all where {names} are not 0": "das sind alle, wenn {names} nicht 0 sind",
    "none where {names} is not 0: the forces cannot balance": (
        "keine, wenn {names} nicht 0 ist: Die Kräfte können sich nicht aufheben"
    ),
    "none where {names} are not 0: the forces cannot balance": (
        "keine, wenn {names} nicht 0 sind: Die Kräfte können sich nicht aufheben"
    ),
    "none: the forces cannot balance": "keine: Die Kräfte können sich nicht aufheben",
    "{count} found, by a search from {starts} starts; there may be others": (
        "{count} gefunden, durch eine Suche von {starts} Anfängen aus; es kann weitere geben"
    ),
    "numbers nearly balance near {place}; it is not proven that there is an equilibrium": (
        "nahe {place} heben sich Zahlen beinahe auf; ein Gleichgewicht ist dort nicht bewiesen"
    ),
    "a force or constraint has no value at rest": (
        "eine Kraft oder Zwangsbedingung hat in Ruhe keinen Wert"
    ),
    "{count} found; there may be others": "{count} gefunden; es kann weitere geben",
    "stable": "stabil",
    "asymptotically stable": "asymptotisch stabil",
    "stable but for drift": "stabil bis auf Drift",
    "stable in the linear approximation": "stabil in linearer Näherung",
    "unstable": "instabil",
    "undecided": "unentschieden",
    "absent": "fehlt",
    "any": "beliebig",
    "{name} any": "{name} beliebig",
    "where": "falls",
    "and": "und",
    "where {conditions}": "falls {conditions}",
    "stable where {conditions}": "stabil, wenn {conditions}",
    "{matrix} is negative": "{matrix} ist negativ",
    "{place} where {conditions}": "{place} falls {conditions}",
    "{verdict} ({reason})": "{verdict} ({reason})",
    "with inputs held at {values}": "bei festgehaltenen Eingängen {values}",
    "Inputs are held at {values}.": "Festgehalten sind die Eingänge {values}.",
    "For other values of the parameters there are as well:": (
        "Bei anderen Werten der Parameter gibt es außerdem:"
    ),
    "And {count} more, in JSON.": "Und {count} weitere, in JSON.",
    "and {count} more, in --json": "und {count} weitere, in --json",
    "parameters have no values": "Parameter haben keine Werte",
    "one of a continuum": "eines von unendlich vielen",
    "it is one of a continuum of equilibria": "es ist eines von unendlich vielen Gleichgewichten",
    "the forces are not smooth there": "die Kräfte sind dort nicht glatt",
    "numbers of the linear system are beyond double precision": (
        "Zahlen des linearen Systems liegen jenseits doppelter Genauigkeit"
    ),
    "no force acts": "keine Kraft wirkt",
    "{matrix} is positive definite": "{matrix} ist positiv definit",
    "{matrix} is degenerate": "{matrix} ist entartet",
    "{matrix} has {count} null directions": "{matrix} hat {count} Nullrichtungen",
    "{matrix} is degenerate, and terms of higher order rise": (
        "{matrix} ist entartet, und Terme höherer Ordnung steigen"
    ),
    "{matrix} is degenerate, and along its null direction the energy has no minimum": (
        "{matrix} ist entartet, und längs ihrer Nullrichtung hat die Energie kein Minimum"
    ),
    "{reason}: the energy has a minimum": "{reason}: Die Energie hat ein Minimum",
    "{reason}, and all motions are damped": "{reason}, und alle Bewegungen sind gedämpft",
    "the constraints are not independent there": "die Zwangsbedingungen sind dort nicht unabhängig",
    "free coordinates are not cyclic": "freie Koordinaten sind nicht zyklisch",
    "{reason}; {names} may drift": "{reason}; {names} kann driften",
    "all motions are damped; {names} may drift": (
        "alle Bewegungen sind gedämpft; {names} kann driften"
    ),
    "a pole has the real part {value}": "ein Pol hat den Realteil {value}",
    "all poles have negative real parts": "alle Pole haben negative Realteile",
    "no pole has a positive real part": "kein Pol hat einen positiven Realteil",
    "poles on the imaginary axis coincide": "Pole auf der imaginären Achse fallen zusammen",
    "Linearization": "Linearisierung",
    "obey": "gehorchen",
    "{law}, q of {names} from": "{law}, q von {names} ab",
    "{letter} of {names}": "{letter} von {names}",
    "{matrix} is symmetric: damping": "{matrix} ist symmetrisch: Dämpfung",
    "{matrix} is antisymmetric: gyroscopic": "{matrix} ist antisymmetrisch: gyroskopisch",
    "{matrix} has a symmetric part, damping, and an antisymmetric one, gyroscopic": (
        "{matrix} hat einen symmetrischen Teil, Dämpfung, und einen antisymmetrischen, gyroskopisch"
    ),
    "State space": "Zustandsraum",
    "Of first order, with the differences from rest of": (
        "Erster Ordnung, mit den Abweichungen von der Ruhe von"
    ),
    "the same is": "ist dasselbe",
    "{matrix} has {rows} rows and {columns} columns; JSON holds it.": (
        "{matrix} hat {rows} Zeilen und {columns} Spalten; sie steht in JSON."
    ),
    "{rows} by {columns}, in --json": "{rows} mal {columns}, in --json",
    "Modes": "Eigenschwingungen",
    "Angular frequencies": "Kreisfrequenzen",
    "angular frequencies": "Kreisfrequenzen",
    "Poles": "Pole",
    "poles and angular frequencies": "Pole und Kreisfrequenzen",
    "pole {value}": "Pol {value}",
    "squared": "quadriert",
    "shape": "Form",
    "shape {values}": "Form {values}",
    "Each column of {matrix} is the shape of a mode, its largest amplitude 1:": (
        "Jede Spalte von {matrix} ist die Form einer Eigenschwingung, ihre größte Amplitude 1:"
    ),
    "among energy and what symmetries linear in the coordinates give": (
        "unter der Energie und dem, was in den Koordinaten lineare Symmetrien geben"
    ),
    "among energy and what symmetries constant in the coordinates give": (
        "unter der Energie und dem, was in den Koordinaten konstante Symmetrien geben"
    ),
    "{count} more that numbers suggest could not be proven": (
        "{count} weitere, die Zahlen nahelegen, waren nicht zu beweisen"
    ),
    "displacement of {names}": "Verschiebung von {names}",
    "rotation around {axis}": "Drehung um {axis}",
    "translation along {axis}": "Verschiebung längs {axis}",
    "boost along {axis}": "Galilei-Transformation längs {axis}",
    "Lyapunov exponents": "Ljapunow-Exponenten",
    "exponent": "Exponent",
    "spread": "Streuung",
    "averaged from {start} to {until}, together {total}": (
        "gemittelt von {start} bis {until}, zusammen {total}"
    ),
    "Left out": "Ausgelassen",
    "symmetries": "Symmetrien",
    "equilibria": "Gleichgewichte",
    "linearization": "Linearisierung",
    "modes": "Eigenschwingungen",
    "there is no equilibrium": "es gibt kein Gleichgewicht",
    "no equilibrium was found from {count} starts": (
        "von {count} Anfängen aus fand sich kein Gleichgewicht"
    ),
    "no equilibrium that was found is stable": "kein Gleichgewicht, das sich fand, ist stabil",
    "nothing can move": "nichts kann sich bewegen",
    "a function is not given": "eine Funktion ist nicht gegeben",
    "Coordinates stay constant while the constraints move if the applied forces, less masses times"
    " accelerations, do no work in the virtual displacements that the constraints allow; constraint"
    " forces do none:": (
        "Koordinaten bleiben konstant, während sich die Zwangsbedingungen bewegen, wenn die"
        " eingeprägten Kräfte, vermindert um Masse mal Beschleunigung, bei den virtuellen"
        " Verrückungen, die die Zwangsbedingungen zulassen, keine Arbeit leisten; Zwangskräfte"
        " leisten keine:"
    ),
    "nothing stays at rest: the equations depend on {time}": (
        "nichts bleibt in Ruhe: Die Gleichungen hängen von {time} ab"
    ),
    "no value for {names}": "kein Wert für {names}",
    "equilibria are not sought where one-sided constraints ({names}) may push": (
        "wo einseitige Zwangsbedingungen ({names}) drücken können, werden keine Gleichgewichte"
        " gesucht"
    ),
    "{count} coordinates and multipliers are more than the {most} analyzed": (
        "{count} Koordinaten und Multiplikatoren sind mehr als die {most}, die untersucht werden"
    ),
    "coordinates are singular there: no inertia goes with a rate of {names}": (
        "Koordinaten sind dort singulär: Zu einer Geschwindigkeit von {names} gehört keine Trägheit"
    ),
    "the equations of motion have no derivatives at this equilibrium": (
        "die Bewegungsgleichungen haben bei diesem Gleichgewicht keine Ableitungen"
    ),
    "a constraint between velocities asks for velocities beside this equilibrium": (
        "eine Zwangsbedingung zwischen Geschwindigkeiten verlangt neben diesem Gleichgewicht"
        " Geschwindigkeiten"
    ),
    "states": "Zustände",
    "inputs": "Eingänge",
    "outputs": "Ausgänge",
    "Along the motion": "Längs der Bewegung",
    "{count} times from {start} to {until}": "{count} Zeiten von {start} bis {until}",
    "E(t) dy = 0 are the changes that constraints allow": (
        "E(t) dy = 0 sind die Änderungen, die Zwangsbedingungen zulassen"
    ),
    "estimated error {estimated}, requested {requested}": (
        "geschätzter Fehler {estimated}, verlangt {requested}"
    ),
    "The matrices are in the JSON, and in FILE.npz with -o FILE.npz.": (
        "Die Matrizen stehen im JSON, und in FILE.npz mit -o FILE.npz."
    ),
    "there is no steady motion": "es gibt keine stationäre Bewegung",
    "no steady motion was found from {count} starts": (
        "von {count} Anfängen aus fand sich keine stationäre Bewegung"
    ),
    "Steady motions": "Stationäre Bewegungen",
    "with {values}": "mit {values}",
    "With {values}:": "Mit {values}:",
    "Small displacements {vector} of {names} from": "Kleine Abweichungen {vector} von {names} aus",
    # -- energies
    "{lagrangian} depends on {time}": "{lagrangian} hängt von {time} ab",
    "{lagrangian} holds the input {name}": "{lagrangian} enthält den Eingang {name}",
    "friction takes energy": "Reibung nimmt Energie",
    "the force {name} does work": "die Kraft {name} leistet Arbeit",
    "the constraint {name} moves": "die Zwangsbedingung {name} bewegt sich",
    "not decided whether this is conserved": "nicht entschieden, ob das erhalten ist",
    "conserved too": "auch erhalten",
    "conserved": "erhalten",
    "not conserved: the moving constraint does work": (
        "nicht erhalten: Die bewegte Zwangsbedingung leistet Arbeit"
    ),
    "not conserved: the moving constraints do work": (
        "nicht erhalten: Die bewegten Zwangsbedingungen leisten Arbeit"
    ),
    "not conserved: the prescribed motion does work": (
        "nicht erhalten: Die vorgegebene Bewegung leistet Arbeit"
    ),
    "not conserved: {reason}": "nicht erhalten: {reason}",
    "It is not conserved: {reason}.": "Sie ist nicht erhalten: {reason}.",
    "Poisson brackets": "Poisson-Klammern",
    "with": "mit",
    "Compared at {count} state with numerical derivatives, to {digits} digits.": (
        "Verglichen an {count} Zustand mit numerischen Ableitungen, auf {digits} Stellen."
    ),
    "Compared at {count} states with numerical derivatives, to {digits} digits.": (
        "Verglichen an {count} Zuständen mit numerischen Ableitungen, auf {digits} Stellen."
    ),
    "{function} is conserved: {rate} vanishes.": "{function} ist erhalten: {rate} verschwindet.",
    "{function} is not conserved.": "{function} ist nicht erhalten.",
    "Branches of equilibria": "Zweige von Gleichgewichten",
    "Marked points": "Ausgezeichnete Punkte",
    "{name} from {start} to {end}": "{name} von {start} bis {end}",
    "{name} from {start} over {middle} to {end}": "{name} von {start} über {middle} bis {end}",
    "{start} over {middle} to {end}": "{start} über {middle} bis {end}",
    "{start} to {end}": "{start} bis {end}",
    "{name} from {start} to {end}; {count} found, from equilibria at {values} values; there may be"
    " others": (
        "{name} von {start} bis {end}; {count} gefunden, von Gleichgewichten bei {values} Werten"
        " aus; es kann weitere geben"
    ),
    "{count} equilibria were not followed: they are degenerate, or parts of continua": (
        "{count} Gleichgewichte wurden nicht verfolgt: Sie sind entartet oder hängen mit unendlich"
        " vielen zusammen"
    ),
    "{count} more were not followed: the budget is spent": (
        "{count} weitere wurden nicht verfolgt: Der Aufwand ist erschöpft"
    ),
    "fold": "Umkehrpunkt",
    "pitchfork": "Gabel",
    "transcritical": "Kreuzung",
    "branch point": "Verzweigung",
    "divergence": "Divergenz",
    "flutter": "Flattern",
    "a closed loop": "eine geschlossene Kurve",
    "begins at {place}": "beginnt bei {place}",
    "ends at {place}: coordinates are singular beyond": (
        "endet bei {place}: Dahinter sind Koordinaten singulär"
    ),
    "ends at {place}: forces grow without bound there": (
        "endet bei {place}: Kräfte wachsen dort über alle Grenzen"
    ),
    "ends at {place}: it leaves every bound": "endet bei {place}: wächst über alle Grenzen",
    "ends at {place}: it could not be followed further": (
        "endet bei {place}: ließ sich nicht weiter verfolgen"
    ),
    "ends at {place}: the budget is spent": "endet bei {place}: Der Aufwand ist erschöpft",
    "branch {numbers}": "Zweig {numbers}",
    "branch {numbers}: {text}": "Zweig {numbers}: {text}",
    "angular frequency {value}": "Kreisfrequenz {value}",
    "branch": "Zweig",
    "branches": "Zweige",
    "stability": "Stabilität",
    "reason": "Grund",
    "number": "Nummer",
    "point": "Punkt",
    "error": "Fehler",
    "frequency": "Frequenz",
    "points of the stretch differ": "Punkte des Stücks unterscheiden sich",
    "the equilibrium could not be found in digits": (
        "das Gleichgewicht ließ sich nicht mit vielen Stellen finden"
    ),
    "branches are those of equilibria, not of steady motions": (
        "Zweige gibt es von Gleichgewichten, nicht von stationären Bewegungen"
    ),
    "equilibria come in continua: fewer equations than coordinates hold them": (
        "Gleichgewichte hängen zusammen: weniger Gleichungen als Koordinaten bestimmen sie"
    ),
    "with constraints between velocities equilibria come in continua": (
        "mit Bedingungen zwischen Geschwindigkeiten hängen Gleichgewichte zusammen"
    ),
    "{count} coordinates and multipliers are more than the {most} of which branches are followed": (
        "{count} Koordinaten und Multiplikatoren sind mehr als die {most}, deren Zweige verfolgt"
        " werden"
    ),
    "branches are of all equilibria, and not of the one at {name}": (
        "Zweige sind von allen Gleichgewichten, nicht von dem bei {name}"
    ),
    "no force depends on a coordinate": "keine Kraft hängt von einer Koordinate ab",
    "both ends of the range of {name} are one": "beide Enden des Bereichs von {name} sind eines",
    "the scene declares {name} positive": "die Szene erklärt {name} für positiv",
    "Frequency response": "Frequenzgang",
    "angular frequencies from {start} to {until}": "Kreisfrequenzen von {start} bis {until}",
    "input": "Eingang",
    "output": "Ausgang",
    "static gain": "statische Verstärkung",
    "at": "bei",
    "gain": "Verstärkung",
    "phase": "Phase",
    "infinite": "unendlich",
    "no output answers to an input": "kein Ausgang antwortet auf einen Eingang",
    "largest gains, each at its frequency; infinite where a pole is undamped": (
        "größte Verstärkungen, jede bei ihrer Frequenz; unendlich, wo ein Pol ungedämpft ist"
    ),
    "poles on the imaginary axis: free motions go on beside these": (
        "Pole auf der imaginären Achse: Freie Bewegungen dauern daneben an"
    ),
    "a pole has a positive real part: motions grow and do not settle to these": (
        "ein Pol hat positiven Realteil: Bewegungen wachsen und gehen nicht in diese über"
    ),
    "rounding is at most {error} of a value": "Rundung ist höchstens {error} eines Werts",
    "{bracket} is not all of the rate: forces, constraints or inputs add to it.": (
        "{bracket} ist nicht die ganze Änderung: Kräfte, Zwangsbedingungen oder Eingänge tragen"
        " dazu bei."
    ),
    # -- other forms
    "Momenta": "Impulse",
    "Hamiltonian": "Hamilton-Funktion",
    "Hamilton's equations": "Hamiltonsche Gleichungen",
    (
        "The momenta are linear in {velocities}, which they determine as a linear system: its"
        " solution has no short form, and half of {product} stands for the kinetic energy."
    ): (
        "Die Impulse sind linear in {velocities}, die sie als lineares Gleichungssystem"
        " bestimmen: dessen Lösung hat keine kurze Form, und die Hälfte von {product} steht"
        " für die kinetische Energie."
    ),
    "{H} is {T} plus what {U} has without velocities.": (
        "{H} ist {T} und was {U} ohne Geschwindigkeiten hat."
    ),
    "{H} is {total}.": "{H} ist {total}.",
    "{H} is not {total}.": "{H} ist nicht {total}.",
    "{H} is the energy {E}.": "{H} ist die Energie {E}.",
    "{H} is conserved: {L} does not depend on {t}.": (
        "{H} ist erhalten: {L} hängt nicht von {t} ab."
    ),
    "{H} is conserved between impacts: {L} does not depend on {t}.": (
        "{H} ist zwischen Stößen erhalten: {L} hängt nicht von {t} ab."
    ),
    "It is not decided whether {H} is conserved.": "Ob {H} erhalten ist, ist nicht entschieden.",
    "{H} is not conserved.": "{H} ist nicht erhalten.",
    "Compared at {count} state with Lagrange's equations, to {digits} digits.": (
        "An {count} Zustand mit den Lagrange-Gleichungen verglichen, auf {digits} Stellen."
    ),
    "Compared at {count} states with Lagrange's equations, to {digits} digits.": (
        "An {count} Zuständen mit den Lagrange-Gleichungen verglichen, auf {digits} Stellen."
    ),
    "Ignored coordinates": "Ignorierte Koordinaten",
    "Routhian": "Routh-Funktion",
    "Velocities of the ignored coordinates": "Geschwindigkeiten der ignorierten Koordinaten",
    "{coordinates} is cyclic; its momentum is a constant of the motion:": (
        "{coordinates} ist zyklisch; der Impuls dazu ist eine Konstante der Bewegung:"
    ),
    "{coordinates} are cyclic; their momenta are constants of the motion:": (
        "{coordinates} sind zyklisch; die Impulse dazu sind Konstanten der Bewegung:"
    ),
    "At the start {values}.": "Am Anfang {values}.",
    "{linear} is gyroscopic: its force does no work.": (
        "{linear} ist gyroskopisch: die Kraft daraus leistet keine Arbeit."
    ),
    "Equations of first order": "Gleichungen erster Ordnung",
    "Equilibrium": "Gleichgewicht",
    "Energies to second order": "Energien bis zur zweiten Ordnung",
    "Constants are left out.": "Konstanten sind weggelassen.",
    "Small oscillations": "Kleine Schwingungen",
    "It is the stable equilibrium nearest to the initial configuration.": (
        "Es ist das stabile Gleichgewicht, das der Anfangslage am nächsten ist."
    ),
    (
        "It is the equilibrium nearest to the initial configuration"
        " of those that are not found to be unstable."
    ): (
        "Es ist unter den Gleichgewichten, die sich nicht als instabi"
        "l erweisen, das der Anfangslage nächste."
    ),
    "Exponents of damped and gyroscopic motions: {poles}.": (
        "Exponenten gedämpfter und gyroskopischer Bewegungen: {poles}."
    ),
    "With the values of the parameters {values}.": "Mit den Werten der Parameter {values}.",
    "Normal coordinates": "Normalkoordinaten",
    "Loss of contact": "Verlust des Kontakts",
    "loss of contact": "Verlust des Kontakts",
    "no contact is closed at the start": "kein Kontakt ist am Anfang geschlossen",
    "while the contacts that are closed at the start last": (
        "solange die am Anfang geschlossenen Kontakte bestehen"
    ),
    "while the contacts that are closed at the start last, and no other closes": (
        "solange die am Anfang geschlossenen Kontakte bestehen und kein anderer schließt"
    ),
    "negative at the start: the contact is lost at once": (
        "am Anfang negativ: Der Kontakt geht sofort verloren"
    ),
    "negative at the start: not all of these contacts last": (
        "am Anfang negativ: Nicht alle diese Kontakte bleiben bestehen"
    ),
    "lost only where this is 0": "verloren nur, wo dies 0 ist",
    "{text}; {reason}": "{text}; {reason}",
    "lost only where {condition}": "verloren nur, wo {condition}",
    "{first} or {second}": "{first} oder {second}",
    "this vanishes nowhere": "dies verschwindet nirgends",
    "{text}, or where the force jumps": "{text}, oder wo die Kraft springt",
    "{first}, that is {second}": "{first}, also {second}",
    "with {values} from the start": "mit {values} vom Anfang",
    "no constraint of the scene is one-sided": "keine Zwangsbedingung der Szene ist einseitig",
    "the start is not known, and so not which contacts are closed": (
        "der Anfang ist nicht bekannt, und so auch nicht, welche Kontakte geschlossen sind"
    ),
    "a constraint is between velocities": "eine Zwangsbedingung besteht zwischen Geschwindigkeiten",
    "contacts that are closed depend on each other": "geschlossene Kontakte hängen voneinander ab",
    "there are too many coordinates for a solution in symbols": (
        "für eine Lösung in Symbolen sind es zu viele Koordinaten"
    ),
    "a gap gives neither a coordinate nor the square of one": (
        "ein Abstand liefert weder eine Koordinate noch das Quadrat einer Koordinate"
    ),
    "the forces of the contacts are too long": "die Kräfte der Kontakte sind zu lang",
    "the mass matrix is singular": "die Massenmatrix ist singulär",
    "no energy is conserved that gives the velocity": (
        "keine Energie ist erhalten, aus der die Geschwindigkeit folgt"
    ),
    "energy and conserved momenta do not remove the velocities": (
        "Energie und erhaltene Impulse beseitigen die Geschwindigkeiten nicht"
    ),
}
