"""Phrases of derivations in German: English → German, with the same parts."""

from __future__ import annotations

GERMAN = {
    # -- punctuation and lists
    "{text}:": "{text}:",
    "{text}.": "{text}.",
    "{name}: {value}": "{name}: {value}",
    "{first} and {last}": "{first} und {last}",
    "{name} on {place}": "{name} auf {place}",
    "{value} for {name}": "{value} für {name}",
    "on {place}": "auf {place}",
    "none": "keine",
    "None.": "Keine.",
    "There are none.": "Es gibt keine.",
    "There are {listed}.": "Es gibt {listed}.",
    "Here": "Dabei ist",
    "By the constraints": "Durch die Zwangsbedingungen",
    "({count} operations)": "({count} Rechenoperationen)",
    "Expressions of more than {most} operations are left out; {option} prints them.": (
        "Ausdrücke mit mehr als {most} Rechenoperationen sind weggelassen; {option} gibt sie aus."
    ),
    # -- system
    "System": "System",
    "Sketch": "Skizze",
    "Particle: {listed}.": "Teilchen: {listed}.",
    "Particles: {listed}.": "Teilchen: {listed}.",
    "{name} of mass {mass} at {place}": "{name} mit der Masse {mass} bei {place}",
    "Parameter": "Parameter",
    "Parameter: {listed}.": "Parameter: {listed}.",
    "Parameters: {listed}.": "Parameter: {listed}.",
    "Parameters": "Parameter",
    "Meaning": "Bedeutung",
    "Value": "Wert",
    "Unit": "Einheit",
    "{coordinate} at the start": "{coordinate} am Anfang",
    "Inputs": "Eingänge",
    "Outputs": "Ausgänge",
    "column {column} of {file}, linear between rows": (
        "Spalte {column} von {file}, linear zwischen den Zeilen"
    ),
    "column {column} of {file}, a cubic spline through the rows": (
        "Spalte {column} von {file}, kubischer Spline durch die Zeilen"
    ),
    "column {column} of {file}, each row until the next": (
        "Spalte {column} von {file}, jede Zeile bis zur nächsten"
    ),
    # -- degrees of freedom
    "DOF": "Freiheitsgrade",
    "Degrees of freedom": "Freiheitsgrade",
    "{count} Cartesian coordinate": "{count} kartesische Koordinate",
    "{count} Cartesian coordinates": "{count} kartesische Koordinaten",
    "{count} independent constraint": "{count} unabhängige Zwangsbedingung",
    "{count} independent constraints": "{count} unabhängige Zwangsbedingungen",
    "{count} degree of freedom": "{count} Freiheitsgrad",
    "{count} degrees of freedom": "{count} Freiheitsgrade",
    "{count} coordinate": "{count} Koordinate",
    "{count} coordinates": "{count} Koordinaten",
    "no particles": "keine Teilchen",
    "{count} further coordinate": "{count} weitere Koordinate",
    "{count} further coordinates": "{count} weitere Koordinaten",
    "{count} nonholonomic constraint": "{count} nichtholonome Zwangsbedingung",
    "{count} nonholonomic constraints": "{count} nichtholonome Zwangsbedingungen",
    "{count} one-sided constraint": "{count} einseitige Zwangsbedingung",
    "{count} one-sided constraints": "{count} einseitige Zwangsbedingungen",
    "{count} constraint built into the positions": (
        "{count} in die Ortsangaben eingebaute Zwangsbedingung"
    ),
    "{count} constraints built into the positions": (
        "{count} in die Ortsangaben eingebaute Zwangsbedingungen"
    ),
    "(implied)": "(stillschweigend)",
    "Constraints": "Zwangsbedingungen",
    "Constraints:": "Zwangsbedingungen:",
    "satisfied by the definitions": "durch die Definitionen erfüllt",
    " on a part of the configurations": " für einen Teil der Konfigurationen",
    "redundant": "überzählig",
    "redundant, implied by {listed}": "überzählig, folgt aus {listed}",
    "one-sided": "einseitig",
    "restitution {value}": "Stoßzahl {value}",
    "nonholonomic": "nichtholonom",
    "holonomic": "holonom",
    "scleronomic": "skleronom",
    "rheonomic": "rheonom",
    "(all)": "(alle)",
    "all": "alle",
    "Coordinates": "Koordinaten",
    "(chosen automatically)": "(selbsttätig gewählt)",
    "Generalized coordinate: {listed}.": "Generalisierte Koordinate: {listed}.",
    "{names} for {ranges}": "{names} für {ranges}",
    "Here {sizes}.": "Hier ist {sizes}.",
    "Before the first elements and after the last": "Vor den ersten Elementen und nach den letzten",
    "Generalized coordinates: {listed}.": "Generalisierte Koordinaten: {listed}.",
    "Generalized coordinate (chosen automatically): {listed}.": (
        "Generalisierte Koordinate (selbsttätig gewählt): {listed}."
    ),
    "Generalized coordinates (chosen automatically): {listed}.": (
        "Generalisierte Koordinaten (selbsttätig gewählt): {listed}."
    ),
    "No coordinate is left: nothing can move.": (
        "Es bleibt keine Koordinate übrig: nichts kann sich bewegen."
    ),
    "The positions are": "Die Orte sind",
    "Singular": "Singulär",
    "{names} where": "{names} bei",
    "The motion of {names} is singular where {zero}.": (
        "Die Bewegung von {names} ist singulär, wo {zero} ist."
    ),
    "Formulation": "Formulierung",
    "minimal ({why}): {minimal} operations predicted for a right-hand side beside {multiplier} of"
    " multiplier": (
        "minimal ({why}): {minimal} Rechenschritte für eine rechte Seite vorhergesagt, gegenüber"
        " {multiplier} mit Multiplikatoren"
    ),
    "multiplier ({why}): {multiplier} operations predicted for a right-hand side beside {minimal}"
    " of minimal": (
        "mit Multiplikatoren ({why}): {multiplier} Rechenschritte für eine rechte Seite"
        " vorhergesagt, gegenüber {minimal} der minimalen"
    ),
    "as asked": "wie verlangt",
    "fewer operations": "weniger Rechenschritte",
    "the coordinates are declared": "die Koordinaten sind angegeben",
    # -- energies and forces
    "Lagrangian": "Lagrange-Funktion",
    "The kinetic energy, the potential and the Lagrangian are": (
        "Die kinetische Energie, das Potential und die Lagrange-Funktion sind"
    ),
    "The kinetic energy, the generalized potential and the Lagrangian are": (
        "Die kinetische Energie, das verallgemeinerte Potential und die Lagrange-Funktion sind"
    ),
    "The kinetic energy, the potential, the Lagrangian and the dissipation function are": (
        "Die kinetische Energie, das Potential, die Lagrange-Funktion und die"
        " Dissipationsfunktion sind"
    ),
    "The kinetic energy, the generalized potential, the Lagrangian and the dissipation function"
    " are": (
        "Die kinetische Energie, das verallgemeinerte Potential, die Lagrange-Funktion und die"
        " Dissipationsfunktion sind"
    ),
    "Here {lagrangian} is {without}.": "Hier steht {lagrangian} {without}.",
    "{terms} in {lagrangian} holds no coordinate and no velocity: it changes no equation"
    " of motion.": (
        "{terms} in {lagrangian} enthält weder Koordinaten noch Geschwindigkeiten und ändert keine"
        " Bewegungsgleichung."
    ),
    "without constants": "ohne Konstanten",
    "without functions of {time} alone": "ohne Funktionen von {time} allein",
    "without constants and functions of {time} alone": (
        "ohne Konstanten und Funktionen von {time} allein"
    ),
    "Generalized forces": "Generalisierte Kräfte",
    "Of the non-conservative forces ({listed}), in this order:": (
        "Der nichtkonservativen Kräfte ({listed}), in dieser Reihenfolge:"
    ),
    # -- equations
    "Equations of motion": "Bewegungsgleichungen",
    "Lagrange's equations": "Lagrange-Gleichungen",
    "Lagrange's equations,": "Die Lagrange-Gleichungen,",
    "read": "lauten",
    "(divided by {factor})": "(geteilt durch {factor})",
    "(multiplied by {factor})": "(multipliziert mit {factor})",
    "{factor} in the equation for {place}": "{factor} in der Gleichung für {place}",
    "{factor} in that for {place}": "{factor} in der für {place}",
    "the equation for {place} by {factor}": "die Gleichung für {place} mit {factor}",
    "that for {place} by {factor}": "die für {place} mit {factor}",
    "Common factor divided out: {listed}.": "Gekürzt wurde der gemeinsame Faktor {listed}.",
    "Common factors divided out: {listed}.": "Gekürzt wurden die gemeinsamen Faktoren {listed}.",
    "Multiplied to be rid of fractions: {listed}.": (
        "Multipliziert, damit keine Brüche bleiben: {listed}."
    ),
    "Solved for the accelerations": "Nach den Beschleunigungen aufgelöst",
    "Solved for the accelerations and multipliers": (
        "Nach den Beschleunigungen und Multiplikatoren aufgelöst"
    ),
    "Not solved for the accelerations, as a linear system": (
        "Nicht nach den Beschleunigungen aufgelöst, als lineares Gleichungssystem"
    ),
    " where few are coupled, the others as a linear system": (
        ", wo wenige gekoppelt sind, die anderen als lineares Gleichungssystem"
    ),
    " with the closure equations, differentiated": " mit den abgeleiteten Schließbedingungen",
    "; contacts determine their multipliers": "; die Kontakte bestimmen ihre Multiplikatoren",
    "{unknowns}) = {forcing} with": "{unknowns}) = {forcing} mit",
    "none: nothing can move": "keine: nichts kann sich bewegen",
    "Result": "Ergebnis",
    "Abbreviations": "Abkürzungen",
    # -- closures and contacts
    "Closure equations": "Schließbedingungen",
    "These hold beside the equations of motion; their left sides are the {letter}.": (
        "Sie gelten neben den Bewegungsgleichungen; ihre linken Seiten sind die {letter}."
    ),
    "These hold beside the equations of motion; their left sides are {phi}, or {psi} where they"
    " hold velocities.": (
        "Sie gelten neben den Bewegungsgleichungen; ihre linken Seiten sind {phi}, oder {psi}, wo"
        " Geschwindigkeiten darin stehen."
    ),
    "The multiplier times the gradient of the left side is the force that the constraint exerts": (
        "Der Multiplikator mal dem Gradienten der linken Seite ist die Zwangskraft der Bedingung"
    ),
    "The multiplier times the gradient of the left side by the velocities is the force that the"
    " constraint exerts": (
        "Der Multiplikator mal dem Gradienten der linken Seite nach den Geschwindigkeiten ist die"
        " Zwangskraft der Bedingung"
    ),
    "The multiplier times the gradient of the left side (by the velocities where it holds them) is"
    " the force that the constraint exerts": (
        "Der Multiplikator mal dem Gradienten der linken Seite (nach den Geschwindigkeiten, wo sie"
        " darin stehen) ist die Zwangskraft der Bedingung"
    ),
    "Contacts": "Kontakte",
    "The gaps {gap} of one-sided constraints and their multipliers obey": (
        "Für die Abstände {gap} einseitiger Zwangsbedingungen und ihre Multiplikatoren gilt"
    ),
    "here": "hier",
    "Times the gradient of the gap, {push} is the force of the contact. A gap that closes with"
    " {closing} opens with {opening}; the restitution {elastic} is {listed}.": (
        "Mal dem Gradienten des Abstands ist {push} die Kontaktkraft. Ein Abstand, der sich mit"
        " {closing} schließt, öffnet sich mit {opening}; die Stoßzahl {elastic} ist {listed}."
    ),
    "Where a gap is 0 its multiplier is at least 0, and times the gradient of the gap it is the"
    " force of the contact; where a gap is open its multiplier is 0": (
        "Wo ein Abstand 0 ist, ist sein Multiplikator mindestens 0 und mal dem Gradienten des"
        " Abstands die Kontaktkraft; wo ein Abstand offen ist, ist sein Multiplikator 0"
    ),
    "A gap that closes opens again with the speed of its closing times its restitution": (
        "Ein Abstand, der sich schließt, öffnet sich wieder mit der Geschwindigkeit, mit der er"
        " sich schloss, mal der Stoßzahl"
    ),
    # -- constraint forces
    "Constraint forces": "Zwangskräfte",
    "beside applied forces; by constraints the multiplier times the gradient": (
        "neben den eingeprägten Kräften; bei Bedingungen der Multiplikator mal dem Gradienten"
    ),
    "force on {place}": "Kraft auf {place}",
    "the accelerations are those of the equations of motion": (
        "die Beschleunigungen sind die der Bewegungsgleichungen"
    ),
    "multipliers and accelerations are those of the equations of motion": (
        "Multiplikatoren und Beschleunigungen sind die der Bewegungsgleichungen"
    ),
    "the force on {bodies} is not unique: what {listed} exerts is written in"
    " coordinates, and acts on no particle": (
        "die Kraft auf {bodies} ist nicht eindeutig: was {listed} ausübt, ist in"
        " Koordinaten angegeben und wirkt auf kein Teilchen"
    ),
    "the forces on {bodies} are not unique: what {listed} exerts is written in"
    " coordinates, and shared among them in no way that is stated": (
        "die Kräfte auf {bodies} sind nicht eindeutig: was {listed} ausübt, ist in"
        " Koordinaten angegeben, und keine Angabe verteilt es auf sie"
    ),
    "the scene gives {listed} no weight": "die Szene gibt {listed} kein Gewicht",
    "these include the term {listed}, because it is written in coordinates": (
        "darin enthalten ist der Term {listed}, weil er in Koordinaten angegeben ist"
    ),
    "these include the terms {listed}, because they are written in coordinates": (
        "darin enthalten sind die Terme {listed}, weil sie in Koordinaten angegeben sind"
    ),
    "multipliers that are not determined, or have no short form: {listed}": (
        "Multiplikatoren, die nicht bestimmt sind oder keine kurze Form haben: {listed}"
    ),
    # -- conservation
    "Conserved": "Erhalten",
    "Conserved quantities": "Erhaltene Größen",
    "among cyclic momenta and energy": "unter zyklischen Impulsen und Energie",
    "No cyclic momentum is conserved, and neither is the energy.": (
        "Kein zyklischer Impuls ist erhalten und auch die Energie nicht."
    ),
    "angular momentum about the {axis} axis": "Drehimpuls um die {axis}-Achse",
    "{momentum} is the angular momentum about the {axis} axis.": (
        "{momentum} ist der Drehimpuls um die {axis}-Achse."
    ),
    "{name} is cyclic": "{name} ist zyklisch",
    "{lagrangian} does not depend on {time}": "{lagrangian} hängt nicht von {time} ab",
    "{lagrangian} does not depend on {time} (between impacts)": (
        "{lagrangian} hängt nicht von {time} ab (zwischen Stößen)"
    ),
    "{reason}, so {symbol} is conserved": "{reason}, also ist {symbol} erhalten",
    "not decided: {names}": "nicht entschieden: {names}",
    "Of {names} this is not decided.": "Für {names} ist das nicht entschieden.",
    "Energy": "Energie",
    "Along a motion {energy} changes at the given rate": (
        "Längs einer Bewegung ändert sich {energy} mit der angegebenen Rate"
    ),
    " between impacts": " zwischen Stößen",
    # -- start and certificate
    "Initial values": "Anfangswerte",
    "The scene gives none.": "Die Szene gibt keine an.",
    "At {time}": "Bei {time} gilt",
    "at rest.": "in Ruhe.",
    "Certificate": "Zertifikat",
    "Certified at {count} random state to {digits} digits, largest mismatch {mismatch}": (
        "Geprüft an {count} zufälligem Zustand auf {digits} Stellen, größte Abweichung {mismatch}"
    ),
    "Certified at {count} random states to {digits} digits, largest mismatch {mismatch}": (
        "Geprüft an {count} zufälligen Zuständen auf {digits} Stellen, größte Abweichung {mismatch}"
    ),
    "At {count} random state these equations were compared, in arithmetic of {digits} digits, with"
    " Lagrange's equations evaluated from {lagrangian} itself; the largest relative mismatch was"
    " {mismatch}.": (
        "An {count} zufälligem Zustand wurden diese Gleichungen mit {digits} Stellen mit den"
        " Lagrange-Gleichungen verglichen, die aus {lagrangian} selbst ausgewertet wurden; die"
        " größte relative Abweichung war {mismatch}."
    ),
    "At {count} random states these equations were compared, in arithmetic of {digits} digits, with"
    " Lagrange's equations evaluated from {lagrangian} itself; the largest relative mismatch was"
    " {mismatch}.": (
        "An {count} zufälligen Zuständen wurden diese Gleichungen mit {digits} Stellen mit den"
        " Lagrange-Gleichungen verglichen, die aus {lagrangian} selbst ausgewertet wurden; die"
        " größte relative Abweichung war {mismatch}."
    ),
    "Every line of the steps compared at {count} of these states to {digits} digits, largest"
    " mismatch {mismatch}": (
        "Jede Zeile der Schritte an {count} dieser Zustände auf {digits} Stellen verglichen, größte"
        " Abweichung {mismatch}"
    ),
    "Every line of the steps was compared at {count} of these states with automatic"
    " differentiation: the largest mismatch was {mismatch}.": (
        "Jede Zeile der Schritte wurde an {count} dieser Zustände mit automatischem Differenzieren"
        " verglichen: die größte Abweichung war {mismatch}."
    ),
    # -- steps
    "Positions": "Orte",
    "{listed} is a coordinate itself.": "{listed} ist selbst eine Koordinate.",
    "{listed} are coordinates themselves.": "{listed} sind selbst Koordinaten.",
    "Velocities": "Geschwindigkeiten",
    "By the chain rule": "Nach der Kettenregel ist",
    "Partial derivatives that are not written vanish.": (
        "Partielle Ableitungen, die nicht dastehen, verschwinden."
    ),
    "Accelerations": "Beschleunigungen",
    "The velocities are differentiated by time once more.": (
        "Die Geschwindigkeiten werden noch einmal nach der Zeit abgeleitet."
    ),
    "Virtual displacements": "Virtuelle Verrückungen",
    "Coordinates are displaced at a fixed time:": "Die Koordinaten werden zu fester Zeit verrückt:",
    "Lagrangian without potential": "Lagrange-Funktion ohne Potential",
    "Kinetic energy": "Kinetische Energie",
    "Potential energy": "Potentielle Energie",
    "Generalized potential": "Verallgemeinertes Potential",
    "Dissipation function": "Dissipationsfunktion",
    "The virtual work of the forces defines them:": (
        "Die virtuelle Arbeit der Kräfte definiert sie:"
    ),
    "The force {name} on {place}:": "Die Kraft {name} auf {place}:",
    "It does no virtual work.": "Sie leistet keine virtuelle Arbeit.",
    "Together:": "Zusammen:",
    "{force} is a torque: {q} is an angle.": "{force} ist ein Drehmoment: {q} ist ein Winkel.",
    "Constraints with multipliers": "Zwangsbedingungen mit Multiplikatoren",
    "Beside the equations of motion {listed} vanishes.": (
        "Neben den Bewegungsgleichungen gilt, dass {listed} verschwindet."
    ),
    "Beside the equations of motion {listed} vanish.": (
        "Neben den Bewegungsgleichungen gilt, dass {listed} verschwinden."
    ),
    "{listed} is the gap of a contact.": "{listed} ist der Abstand eines Kontakts.",
    "{listed} are gaps of contacts.": "{listed} sind Abstände von Kontakten.",
    "For {place}:": "Für {place}:",
    "so that": "so dass",
    "and, divided by {factor},": "und, geteilt durch {factor},",
    "and, multiplied by {factor},": "und, multipliziert mit {factor},",
    "Applied forces": "Eingeprägte Kräfte",
    "No applied force acts on a particle.": "Auf kein Teilchen wirkt eine eingeprägte Kraft.",
    "d'Alembert's principle": "Das d'Alembertsche Prinzip",
    "Constraint forces do no work in virtual displacements that the constraints allow:": (
        "Zwangskräfte leisten keine Arbeit bei virtuellen Verrückungen, die mit den"
        " Zwangsbedingungen verträglich sind:"
    ),
    "The {listed} are restricted by the constraints that are kept: with a multiplier for each of"
    " these, every coefficient vanishes.": (
        "Die {listed} sind durch die beibehaltenen Zwangsbedingungen eingeschränkt: mit einem"
        " Multiplikator für jede von diesen verschwindet jeder Koeffizient."
    ),
    "The {listed} are independent, so the coefficient of each vanishes.": (
        "Die {listed} sind unabhängig, also verschwindet der Koeffizient einer jeden."
    ),
    "{listed} is written in coordinates and acts on no particle: its inertia less force is"
    " {further}.": (
        "{listed} ist in Koordinaten angegeben und greift an keinem Teilchen an: Trägheit minus"
        " Kraft davon ist {further}."
    ),
    "{listed} are written in coordinates and act on no particle: their inertia less force is"
    " {further}.": (
        "{listed} sind in Koordinaten angegeben und greifen an keinem Teilchen an: Trägheit minus"
        " Kraft davon ist {further}."
    ),
    "The same by Lagrange's equations": "Dasselbe mit den Lagrange-Gleichungen",
    "nothing": "nichts",
    "{difference} at most, relative to their terms": (
        "höchstens {difference}, bezogen auf ihre Summanden"
    ),
    "Evaluated from {lagrangian} at {count} random state in {digits} digits, these differ from the"
    " coefficients above by {size}: both ways give the same equations.": (
        "Aus {lagrangian} an {count} zufälligem Zustand mit {digits} Stellen ausgewertet, weichen"
        " sie von den Koeffizienten oben um {size} ab: beide Wege führen zu denselben Gleichungen."
    ),
    "Evaluated from {lagrangian} at {count} random states in {digits} digits, these differ from the"
    " coefficients above by {size}: both ways give the same equations.": (
        "Aus {lagrangian} an {count} zufälligen Zuständen mit {digits} Stellen ausgewertet, weichen"
        " sie von den Koeffizienten oben um {size} ab: beide Wege führen zu denselben Gleichungen."
    ),
    "Newton's equations": "Die Newtonschen Gleichungen",
    "The constraint forces that make up the difference are listed below.": (
        "Die Zwangskräfte, die den Unterschied ausmachen, stehen weiter unten."
    ),
    "Cyclic coordinates, momenta and energy": "Zyklische Koordinaten, Impulse und Energie",
    "{lagrangian} depends on every coordinate.": "{lagrangian} hängt von jeder Koordinate ab.",
    "{listed} does not stand in {lagrangian}, but forces or constraints change its momentum.": (
        "{listed} steht nicht in {lagrangian}, aber Kräfte oder Zwangsbedingungen ändern den"
        " Impuls dazu."
    ),
    "{listed} do not stand in {lagrangian}, but forces or constraints change their momenta.": (
        "{listed} stehen nicht in {lagrangian}, aber Kräfte oder Zwangsbedingungen ändern die"
        " Impulse dazu."
    ),
    "{name} is cyclic, {slope}, and its momentum is conserved,": (
        "{name} ist zyklisch, {slope}, und der Impuls dazu ist erhalten,"
    ),
    "The energy function is": "Die Energiefunktion ist",
    "It changes at the rate": "Sie ändert sich mit der Rate",
    "It is conserved, since {slope}": "Sie ist erhalten, denn es ist {slope}",
    " and the forces do no work": " und die Kräfte leisten keine Arbeit",
    ", between impacts": ", zwischen Stößen",
    "; it is {energy}": "; sie ist {energy}",
    "; it is not {energy}": "; sie ist nicht {energy}",
    # -- equilibrium by virtual work
    "Principle of virtual work": "Prinzip der virtuellen Arbeit",
    "A system stays at rest if the applied forces do no work in the virtual displacements that"
    " the constraints allow; constraint forces do none:": (
        "Ein System bleibt in Ruhe, wenn die eingeprägten Kräfte bei den virtuellen Verrückungen,"
        " die die Zwangsbedingungen zulassen, keine Arbeit leisten; Zwangskräfte leisten keine:"
    ),
    "Equilibrium": "Gleichgewicht",
    "These equations have no solution in closed form that was found.": (
        "Eine Lösung dieser Gleichungen in geschlossener Form wurde nicht gefunden."
    ),
    "No configuration satisfies these equations: the forces cannot balance.": (
        "Keine Lage erfüllt diese Gleichungen: Die Kräfte können sich nicht aufheben."
    ),
    "These equations are satisfied exactly by": ("Diese Gleichungen erfüllen genau"),
    "These equations are satisfied, among others perhaps, by": (
        "Diese Gleichungen erfüllen, vielleicht neben anderen,"
    ),
    "Here {names} is not 0.": "Dabei ist {names} nicht 0.",
    "Here {names} are not 0.": "Dabei sind {names} nicht 0.",
    "any {names}": "beliebige {names}",
    "any {names} where": "beliebige {names} mit",
    "provided that": "sofern",
    "or": "oder",
}
