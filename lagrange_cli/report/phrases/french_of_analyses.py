"""Phrases of analyses and other forms in French: English → French, with the same parts."""

from __future__ import annotations

FRENCH_OF_ANALYSES = {
    "Equilibria": "Équilibres",
    "these are all": "il n'y en a pas d'autres",
    "these are all where {names} is not 0": (
        "il n'y en a pas d'autres quand {names} n'est pas nul"
    ),
    "these are all where {names} are not 0": (
        "il n'y en a pas d'autres quand aucun de {names} n'est nul"
    ),
    "none where {names} is not 0: the forces cannot balance": (
        "aucun quand {names} n'est pas nul\u00a0: les forces ne peuvent se compenser"
    ),
    "none where {names} are not 0: the forces cannot balance": (
        "aucun quand aucun de {names} n'est nul\u00a0: les forces ne peuvent se compenser"
    ),
    "none: the forces cannot balance": "aucun\u00a0: les forces ne peuvent se compenser",
    "{count} found, by a search from {starts} starts; there may be others": (
        "{count} par une recherche à partir de {starts} départs\u00a0; il peut y en avoir d'autres"
    ),
    "numbers nearly balance near {place}; it is not proven that there is an equilibrium": (
        "près de {place} les nombres s'équilibrent presque ; aucun équilibre n'y est prouvé"
    ),
    "a force or constraint has no value at rest": (
        "une force ou une liaison n'a pas de valeur au repos"
    ),
    "{count} found; there may be others": "{count} trouvés\u00a0; il peut y en avoir d'autres",
    "stable": "stable",
    "asymptotically stable": "asymptotiquement stable",
    "stable but for drift": "stable à la dérive près",
    "stable in the linear approximation": "stable à l'approximation linéaire",
    "unstable": "instable",
    "undecided": "indécis",
    "absent": "absent",
    "any": "quelconque",
    "stable where {conditions}": "stable quand {conditions}",
    "{matrix} is negative": "{matrix} est négatif",
    "{name} any": "{name} quelconque",
    "where": "si",
    "and": "et",
    "where {conditions}": "si {conditions}",
    "{place} where {conditions}": "{place} si {conditions}",
    "{verdict} ({reason})": "{verdict} ({reason})",
    "with inputs held at {values}": "avec les entrées maintenues à {values}",
    "Inputs are held at {values}.": "Les entrées sont maintenues à {values}.",
    "For other values of the parameters there are as well:": (
        "Pour d'autres valeurs des paramètres il y a aussi\u00a0:"
    ),
    "And {count} more, in JSON.": "Et {count} de plus, en JSON.",
    "and {count} more, in --json": "et {count} de plus, dans --json",
    "parameters have no values": "des paramètres n'ont pas de valeur",
    "one of a continuum": "un parmi une infinité",
    "it is one of a continuum of equilibria": "il est un parmi une infinité d'équilibres",
    "the forces are not smooth there": "les forces n'y sont pas régulières",
    "numbers of the linear system are beyond double precision": (
        "des nombres du système linéaire dépassent la double précision"
    ),
    "no force acts": "aucune force n'agit",
    "{matrix} is positive definite": "{matrix} est définie positive",
    "{matrix} is degenerate": "{matrix} est dégénérée",
    "{matrix} has {count} null directions": "{matrix} a {count} directions nulles",
    "{matrix} is degenerate, and terms of higher order rise": (
        "{matrix} est dégénérée, et les termes d'ordre supérieur croissent"
    ),
    "{matrix} is degenerate, and along its null direction the energy has no minimum": (
        "{matrix} est dégénérée, et l'énergie n'a pas de minimum le long de sa direction nulle"
    ),
    "{reason}: the energy has a minimum": "{reason}\u00a0: l'énergie a un minimum",
    "{reason}, and all motions are damped": "{reason}, et tous les mouvements sont amortis",
    "the constraints are not independent there": "les liaisons n'y sont pas indépendantes",
    "free coordinates are not cyclic": "des coordonnées libres ne sont pas cycliques",
    "{reason}; {names} may drift": "{reason}\u00a0; {names} peut dériver",
    "all motions are damped; {names} may drift": (
        "tous les mouvements sont amortis\u00a0; {names} peut dériver"
    ),
    "a pole has the real part {value}": "un pôle a la partie réelle {value}",
    "all poles have negative real parts": "tous les pôles ont des parties réelles négatives",
    "no pole has a positive real part": "aucun pôle n'a une partie réelle positive",
    "poles on the imaginary axis coincide": "des pôles sur l'axe imaginaire coïncident",
    "Linearization": "Linéarisation",
    "obey": "obéissent à",
    "{law}, q of {names} from": "{law}, q de {names} à partir de",
    "{letter} of {names}": "{letter} de {names}",
    "{matrix} is symmetric: damping": "{matrix} est symétrique\u00a0: amortissement",
    "{matrix} is antisymmetric: gyroscopic": "{matrix} est antisymétrique\u00a0: gyroscopique",
    "{matrix} has a symmetric part, damping, and an antisymmetric one, gyroscopic": (
        "{matrix} a une partie symétrique, amortissement, et une antisymétrique, gyroscopique"
    ),
    "State space": "Espace d'état",
    "Of first order, with the differences from rest of": (
        "Au premier ordre, avec les écarts au repos de"
    ),
    "the same is": "c'est",
    "{matrix} has {rows} rows and {columns} columns; JSON holds it.": (
        "{matrix} a {rows} lignes et {columns} colonnes\u00a0; elle est en JSON."
    ),
    "{rows} by {columns}, in --json": "{rows} sur {columns}, dans --json",
    "Modes": "Modes propres",
    "Angular frequencies": "Pulsations",
    "angular frequencies": "pulsations",
    "Poles": "Pôles",
    "poles and angular frequencies": "pôles et pulsations",
    "pole {value}": "pôle {value}",
    "squared": "au carré",
    "shape": "forme",
    "shape {values}": "forme {values}",
    "Each column of {matrix} is the shape of a mode, its largest amplitude 1:": (
        "Chaque colonne de {matrix} est la forme d'un mode, sa plus grande amplitude 1\u00a0:"
    ),
    "among energy and what symmetries linear in the coordinates give": (
        "parmi l'énergie et ce que donnent les symétries linéaires en les coordonnées"
    ),
    "among energy and what symmetries constant in the coordinates give": (
        "parmi l'énergie et ce que donnent les symétries constantes en les coordonnées"
    ),
    "{count} more that numbers suggest could not be proven": (
        "{count} de plus, que des nombres suggèrent, n'ont pu être prouvées"
    ),
    "displacement of {names}": "déplacement de {names}",
    "rotation around {axis}": "rotation autour de {axis}",
    "translation along {axis}": "translation le long de {axis}",
    "boost along {axis}": "transformation de Galilée le long de {axis}",
    "Lyapunov exponents": "Exposants de Liapounov",
    "exponent": "exposant",
    "spread": "dispersion",
    "averaged from {start} to {until}, together {total}": (
        "moyennés de {start} à {until}, en somme {total}"
    ),
    "Left out": "Omis",
    "symmetries": "symétries",
    "equilibria": "équilibres",
    "linearization": "linéarisation",
    "modes": "modes propres",
    "there is no equilibrium": "il n'y a pas d'équilibre",
    "no equilibrium was found from {count} starts": (
        "aucun équilibre ne fut trouvé à partir de {count} départs"
    ),
    "no equilibrium that was found is stable": "aucun équilibre trouvé n'est stable",
    "nothing can move": "rien ne peut bouger",
    "a function is not given": "une fonction n'est pas donnée",
    "Coordinates stay constant while the constraints move if the applied forces, less masses times"
    " accelerations, do no work in the virtual displacements that the constraints allow; constraint"
    " forces do none:": (
        "Les coordonnées restent constantes alors que les liaisons se meuvent si les forces"
        " appliquées, diminuées des masses fois les accélérations, ne travaillent pas dans les"
        " déplacements virtuels que les liaisons permettent\u00a0; les forces de liaison ne"
        " travaillent pas\u00a0:"
    ),
    "nothing stays at rest: the equations depend on {time}": (
        "rien ne reste au repos\u00a0: les équations dépendent de {time}"
    ),
    "no value for {names}": "aucune valeur pour {names}",
    "equilibria are not sought where one-sided constraints ({names}) may push": (
        "on ne cherche pas d'équilibres où des liaisons unilatérales ({names}) peuvent pousser"
    ),
    "{count} coordinates and multipliers are more than the {most} analyzed": (
        "{count} coordonnées et multiplicateurs sont plus que les {most} analysés"
    ),
    "coordinates are singular there: no inertia goes with a rate of {names}": (
        "des coordonnées y sont singulières\u00a0: à une vitesse de {names} ne répond aucune"
        " inertie"
    ),
    "the equations of motion have no derivatives at this equilibrium": (
        "les équations du mouvement n'ont pas de dérivées en cet équilibre"
    ),
    "a constraint between velocities asks for velocities beside this equilibrium": (
        "une liaison entre vitesses demande des vitesses près de cet équilibre"
    ),
    "states": "états",
    "inputs": "entrées",
    "outputs": "sorties",
    "Along the motion": "Le long du mouvement",
    "{count} times from {start} to {until}": "{count} instants de {start} à {until}",
    "E(t) dy = 0 are the changes that constraints allow": (
        "E(t) dy = 0 sont les changements que les liaisons permettent"
    ),
    "estimated error {estimated}, requested {requested}": (
        "erreur estimée {estimated}, demandée {requested}"
    ),
    "The matrices are in the JSON, and in FILE.npz with -o FILE.npz.": (
        "Les matrices sont dans le JSON, et dans FILE.npz avec -o FILE.npz."
    ),
    "there is no steady motion": "il n'y a pas de mouvement stationnaire",
    "no steady motion was found from {count} starts": (
        "aucun mouvement stationnaire ne fut trouvé à partir de {count} départs"
    ),
    "Steady motions": "Mouvements stationnaires",
    "with {values}": "avec {values}",
    "With {values}:": "Avec {values}\u00a0:",
    "Small displacements {vector} of {names} from": "De petits écarts {vector} de {names} à",
    # -- energies
    "{lagrangian} depends on {time}": "{lagrangian} dépend de {time}",
    "{lagrangian} holds the input {name}": "{lagrangian} contient l'entrée {name}",
    "friction takes energy": "le frottement prend de l'énergie",
    "the force {name} does work": "la force {name} travaille",
    "the constraint {name} moves": "la liaison {name} bouge",
    "not decided whether this is conserved": "il n'est pas décidé si cela est conservé",
    "conserved too": "conservée aussi",
    "conserved": "conservée",
    "not conserved: the moving constraint does work": (
        "non conservée\u00a0: la liaison mobile travaille"
    ),
    "not conserved: the moving constraints do work": (
        "non conservée\u00a0: les liaisons mobiles travaillent"
    ),
    "not conserved: the prescribed motion does work": (
        "non conservée\u00a0: le mouvement imposé travaille"
    ),
    "not conserved: {reason}": "non conservée\u00a0: {reason}",
    "It is not conserved: {reason}.": "Elle n'est pas conservée\u00a0: {reason}.",
    "Poisson brackets": "Crochets de Poisson",
    "with": "avec",
    "Compared at {count} state with numerical derivatives, to {digits} digits.": (
        "Comparé en {count} état aux dérivées numériques, à {digits} chiffres."
    ),
    "Compared at {count} states with numerical derivatives, to {digits} digits.": (
        "Comparé en {count} états aux dérivées numériques, à {digits} chiffres."
    ),
    "{function} is conserved: {rate} vanishes.": "{function} est conservé\u00a0: {rate} s'annule.",
    "{function} is not conserved.": "{function} n'est pas conservé.",
    "Branches of equilibria": "Branches d'équilibres",
    "Marked points": "Points remarquables",
    "{name} from {start} to {end}": "{name} de {start} à {end}",
    "{name} from {start} over {middle} to {end}": "{name} de {start} par {middle} à {end}",
    "{start} over {middle} to {end}": "{start} par {middle} à {end}",
    "{start} to {end}": "{start} à {end}",
    "{name} from {start} to {end}; {count} found, from equilibria at {values} values; there may be"
    " others": (
        "{name} de {start} à {end}\u00a0; trouvées\u00a0: {count}, à partir des équilibres pour"
        " {values} valeurs\u00a0; il peut y en avoir d'autres"
    ),
    "{count} equilibria were not followed: they are degenerate, or parts of continua": (
        "{count} équilibres n'ont pas été suivis\u00a0: ils sont dégénérés ou font partie de"
        " continuums"
    ),
    "{count} more were not followed: the budget is spent": (
        "{count} autres n'ont pas été suivis\u00a0: le budget est épuisé"
    ),
    "fold": "pli",
    "pitchfork": "fourche",
    "transcritical": "croisement",
    "branch point": "bifurcation",
    "divergence": "divergence",
    "flutter": "flottement",
    "a closed loop": "une courbe fermée",
    "begins at {place}": "commence en {place}",
    "ends at {place}: coordinates are singular beyond": (
        "finit en {place}\u00a0: au-delà les coordonnées sont singulières"
    ),
    "ends at {place}: forces grow without bound there": (
        "finit en {place}\u00a0: les forces y croissent sans borne"
    ),
    "ends at {place}: it leaves every bound": "finit en {place}\u00a0: dépasse toute borne",
    "ends at {place}: it could not be followed further": (
        "finit en {place}\u00a0: n'a pas pu être suivie plus loin"
    ),
    "ends at {place}: the budget is spent": "finit en {place}\u00a0: le budget est épuisé",
    "branch {numbers}": "branche {numbers}",
    "branch {numbers}: {text}": "branche {numbers}\u00a0: {text}",
    "angular frequency {value}": "pulsation {value}",
    "branch": "branche",
    "branches": "branches",
    "stability": "stabilité",
    "reason": "raison",
    "number": "numéro",
    "point": "point",
    "error": "erreur",
    "frequency": "pulsation",
    "points of the stretch differ": "des points du morceau diffèrent",
    "the equilibrium could not be found in digits": (
        "l'équilibre n'a pas pu être trouvé avec beaucoup de chiffres"
    ),
    "branches are those of equilibria, not of steady motions": (
        "les branches sont celles d'équilibres, non de mouvements stationnaires"
    ),
    "equilibria come in continua: fewer equations than coordinates hold them": (
        "les équilibres forment des continuums\u00a0: moins d'équations que de coordonnées les"
        " déterminent"
    ),
    "with constraints between velocities equilibria come in continua": (
        "avec des liaisons entre vitesses les équilibres forment des continuums"
    ),
    "{count} coordinates and multipliers are more than the {most} of which branches are followed": (
        "{count} coordonnées et multiplicateurs sont plus que les {most} dont les branches sont"
        " suivies"
    ),
    "branches are of all equilibria, and not of the one at {name}": (
        "les branches sont de tous les équilibres, non de celui en {name}"
    ),
    "no force depends on a coordinate": "aucune force ne dépend d'une coordonnée",
    "both ends of the range of {name} are one": (
        "les deux extrémités de l'intervalle de {name} n'en font qu'une"
    ),
    "the scene declares {name} positive": "la scène déclare {name} positif",
    "Frequency response": "Réponse en fréquence",
    "angular frequencies from {start} to {until}": "pulsations de {start} à {until}",
    "input": "entrée",
    "output": "sortie",
    "static gain": "gain statique",
    "at": "à",
    "gain": "gain",
    "phase": "phase",
    "infinite": "infini",
    "no output answers to an input": "aucune sortie ne répond à une entrée",
    "largest gains, each at its frequency; infinite where a pole is undamped": (
        "gains les plus grands, chacun à sa fréquence\u00a0; infini où un pôle n'est pas amorti"
    ),
    "poles on the imaginary axis: free motions go on beside these": (
        "pôles sur l'axe imaginaire\u00a0: des mouvements libres persistent à côté"
    ),
    "a pole has a positive real part: motions grow and do not settle to these": (
        "un pôle a une partie réelle positive\u00a0: les mouvements croissent et ne tendent pas"
        " vers ceux-ci"
    ),
    "rounding is at most {error} of a value": "l'arrondi est au plus {error} d'une valeur",
    "{bracket} is not all of the rate: forces, constraints or inputs add to it.": (
        "{bracket} n'est pas tout le taux\u00a0: forces, contraintes ou entrées y contribuent."
    ),
    # -- other forms
    "Momenta": "Moments conjugués",
    "Hamiltonian": "Hamiltonien",
    "Hamilton's equations": "Équations de Hamilton",
    (
        "The momenta are linear in {velocities}, which they determine as a linear system: its"
        " solution has no short form, and half of {product} stands for the kinetic energy."
    ): (
        "Les moments sont linéaires en {velocities}, qu'ils déterminent par un système"
        " linéaire : sa solution n'a pas de forme courte, et la moitié de {product} tient"
        " lieu d'énergie cinétique."
    ),
    "{H} is {T} plus what {U} has without velocities.": (
        "{H} est {T} plus ce que {U} a sans vitesses."
    ),
    "{H} is {total}.": "{H} est {total}.",
    "{H} is not {total}.": "{H} n'est pas {total}.",
    "{H} is the energy {E}.": "{H} est l'énergie {E}.",
    "{H} is conserved: {L} does not depend on {t}.": (
        "{H} est conservé : {L} ne dépend pas de {t}."
    ),
    "{H} is conserved between impacts: {L} does not depend on {t}.": (
        "{H} est conservé entre les chocs : {L} ne dépend pas de {t}."
    ),
    "It is not decided whether {H} is conserved.": "Il n'est pas décidé si {H} est conservé.",
    "{H} is not conserved.": "{H} n'est pas conservé.",
    "Compared at {count} state with Lagrange's equations, to {digits} digits.": (
        "Comparé en {count} état aux équations de Lagrange, à {digits} chiffres."
    ),
    "Compared at {count} states with Lagrange's equations, to {digits} digits.": (
        "Comparé en {count} états aux équations de Lagrange, à {digits} chiffres."
    ),
    "Ignored coordinates": "Coordonnées ignorées",
    "Routhian": "Fonction de Routh",
    "Velocities of the ignored coordinates": "Vitesses des coordonnées ignorées",
    "{coordinates} is cyclic; its momentum is a constant of the motion:": (
        "{coordinates} est cyclique ; son moment est une constante du mouvement :"
    ),
    "{coordinates} are cyclic; their momenta are constants of the motion:": (
        "{coordinates} sont cycliques ; leurs moments sont des constantes du mouvement :"
    ),
    "At the start {values}.": "Au départ {values}.",
    "{linear} is gyroscopic: its force does no work.": (
        "{linear} est gyroscopique : sa force ne travaille pas."
    ),
    "Equations of first order": "Équations du premier ordre",
    "Equilibrium": "Équilibre",
    "Energies to second order": "Énergies au second ordre",
    "Constants are left out.": "Les constantes sont omises.",
    "Small oscillations": "Petites oscillations",
    "It is the stable equilibrium nearest to the initial configuration.": (
        "C'est l'équilibre stable le plus proche de la configuration initiale."
    ),
    (
        "It is the equilibrium nearest to the initial configuration"
        " of those that are not found to be unstable."
    ): (
        "C'est, parmi les équilibres qui ne se révèlent pas instables"
        ", le plus proche de la configuration initiale."
    ),
    "Exponents of damped and gyroscopic motions: {poles}.": (
        "Exposants des mouvements amortis et gyroscopiques\u00a0: {poles}."
    ),
    "With the values of the parameters {values}.": "Avec les valeurs des paramètres {values}.",
    "Normal coordinates": "Coordonnées normales",
    "Loss of contact": "Perte de contact",
    "loss of contact": "perte de contact",
    "no contact is closed at the start": "aucun contact n'est fermé au départ",
    "while the contacts that are closed at the start last": (
        "tant que durent les contacts fermés au départ"
    ),
    "while the contacts that are closed at the start last, and no other closes": (
        "tant que durent les contacts fermés au départ et qu'aucun autre ne se ferme"
    ),
    "negative at the start: the contact is lost at once": (
        "négatif au départ\u00a0: le contact est perdu aussitôt"
    ),
    "negative at the start: not all of these contacts last": (
        "négatif au départ\u00a0: ces contacts ne durent pas tous"
    ),
    "lost only where this is 0": "perdu seulement où cela vaut 0",
    "{text}; {reason}": "{text}\u00a0; {reason}",
    "lost only where {condition}": "perdu seulement où {condition}",
    "{first} or {second}": "{first} ou {second}",
    "this vanishes nowhere": "cela ne s'annule nulle part",
    "{text}, or where the force jumps": "{text}, ou bien où la force saute",
    "{first}, that is {second}": "{first}, soit {second}",
    "with {values} from the start": "avec {values} au départ",
    "no constraint of the scene is one-sided": "aucune liaison de la scène n'est unilatérale",
    "the start is not known, and so not which contacts are closed": (
        "le départ n'est pas connu, ni donc quels contacts sont fermés"
    ),
    "a constraint is between velocities": "une liaison porte sur des vitesses",
    "contacts that are closed depend on each other": (
        "des contacts fermés dépendent l'un de l'autre"
    ),
    "there are too many coordinates for a solution in symbols": (
        "les coordonnées sont trop nombreuses pour une solution littérale"
    ),
    "a gap gives neither a coordinate nor the square of one": (
        "un jeu ne donne ni une coordonnée ni le carré d'une coordonnée"
    ),
    "the forces of the contacts are too long": "les forces des contacts sont trop longues",
    "the mass matrix is singular": "la matrice de masse est singulière",
    "no energy is conserved that gives the velocity": (
        "aucune énergie conservée ne donne la vitesse"
    ),
    "energy and conserved momenta do not remove the velocities": (
        "l'énergie et les quantités de mouvement conservées n'éliminent pas les vitesses"
    ),
}
